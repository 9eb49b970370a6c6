"""Derives the facts of every sentence of feedback again, from the recording and the label maps of a bundle.

    check_feedback.py BUNDLE ...

Shares no code with typodont. Read are: the ticks, stages, exercise and tables of `recording.mcap`, the tissues before and
after, and when each voxel was removed. Derived are, for every error episode and the evidence of `session.json`: tissue,
wall, place, depth, volume, force and time. Then every sentence of `report.html` is compared with the one episode or
evidence that it refers to: each number with a unit, each wall and each tissue in it must be found there. Prints a line per
difference and, last, the number of sessions, episodes and sentences; exits with 1 if anything differs.
"""

import gzip
import html
import json
import pathlib
import re
import sys

import mcap.reader
import numpy as np
from scipy.ndimage import binary_dilation, generate_binary_structure
from scipy.spatial import cKDTree

TICK = np.dtype([
    ("cdr", "4u1"), ("tick", "<u8"), ("position", "<f4", 3), ("orientation", "<f4", 4), ("buttons", "<u4"),
    ("force", "<f4", 3), ("tip", "<f4", 3), ("spring", "<f4"), ("removed", "<u4"), ("touched", "u1"),
    ("instrument", "u1"), ("cutting", "u1"), ("pad", "u1"), ("torque", "<f4", 3), ("lead", "<f4", 3),
])

#: Tolerances: lengths in mm, forces in N (stored as 32-bit numbers).
MM, NEWTON = 2e-4, 2e-5

#: A pause in ticks that ends a spell of contact, and one in s that ends a period of cutting at one wall.
CONTACT_GAP, CUTTING_PAUSE = 250, 3.0

#: Episodes of one kind that session.json holds at most; and the least volume of cut or left tissue that is told, mm³.
EPISODES_MAX, VOLUME_MIN = 20, 0.02

#: Kinds of instruments that cut without rotating.
BLADES = {"spoon_excavator", "carver"}

WALLS = {
    "on the buccal wall": "buccal", "on the lingual wall": "lingual", "on the mesial wall": "mesial",
    "on the distal wall": "distal", "on the occlusal side": "occlusal", "on the cavity floor": "apical",
}


def nrrd(data):
    """Samples as [z, y, x], the centre of the first voxel and the distance between voxels."""
    end = data.index(b"\n\n")
    field = dict(line.split(": ", 1) for line in data[:end].decode("latin1").splitlines() if re.match(r"[\w ]+: ", line))
    numbers = lambda text: [float(v) for v in re.findall(r"-?[\d.]+(?:e-?\d+)?", text)]
    sizes = [int(v) for v in numbers(field["sizes"])]
    kinds = {"uint8": "u1", "unsigned char": "u1", "uchar": "u1", "float": "<f4", "uint32": "<u4"}
    body = data[end + 2:]
    body = gzip.decompress(body) if field["encoding"] in ("gzip", "gz") else body
    directions = numbers(field["space directions"])
    samples = np.frombuffer(body, kinds[field["type"]]).reshape(sizes[::-1])
    return samples, np.array(numbers(field["space origin"])), np.array([directions[0], directions[4], directions[8]])


def seeded_random(seed, name):
    """SplitMix64 over the bytes of a name, as exercises draw their sites."""
    bits = (1 << 64) - 1

    def mix(z):
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9 & bits
        z = (z ^ (z >> 27)) * 0x94d049bb133111eb & bits
        return z ^ (z >> 31)

    state = mix(seed + 0x9e3779b97f4a7c15 & bits)
    for byte in name.encode():
        state = mix(state + byte + 0x9e3779b97f4a7c15 & bits)
    return state


def text(written):
    """A text of an exercise in English: as it stands, or by language."""
    return written if isinstance(written, str) else written["en"]


class Session:
    """A bundle, as independent programs read it."""

    def __init__(self, bundle):
        self.bundle = bundle
        self.result = json.loads((bundle / "session.json").read_text())
        attached, self.stage_spans, self.changes, messages = {}, [], [], []
        with open(bundle / "recording.mcap", "rb") as file:
            reader = mcap.reader.make_reader(file)
            attached = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
            for _, channel, message in reader.iter_messages(topics=["/haptic", "/event"]):
                if channel.topic == "/haptic":
                    messages.append(message.data)
                else:
                    self.event(json.loads(message.data))
        self.ticks = np.frombuffer(b"".join(messages), TICK)
        self.scenario = json.loads(attached["scenario.json"])
        table = json.loads(attached["content/tissues.json"])["tissues"]
        self.number = {tissue["name"]: tissue["id"] for tissue in table}
        self.title = {tissue["name"]: text(tissue["title"]).lower() for tissue in table}
        self.role = np.zeros(256, object)
        for tissue in table:
            self.role[tissue["id"]] = tissue["role"]
        self.sites = self.sites_of_draws((bundle / "initial.seg.nrrd").read_bytes())
        entries = {entry["id"]: entry for entry in json.loads(attached["content/instruments.json"])["instruments"]}
        tray = [entries.get(name, {}) for name in self.scenario.get("instruments", [])]
        self.is_bur = np.array([bool(e.get("cuts")) and e.get("kind") not in BLADES for e in tray] + [False] * 256)
        self.changes += self.sealed_changes()
        self.before, self.origin, self.spacing = nrrd((bundle / "initial.seg.nrrd").read_bytes())
        self.after, _, _ = nrrd((bundle / "final.seg.nrrd").read_bytes())
        self.fallen = self.removal_ticks()
        self.removed = (self.before != 0) & (self.after == 0)
        self.voxel_mm3 = float(np.prod(self.spacing))
        self.force = np.linalg.norm(self.ticks["force"].astype(float) - self.ticks["lead"].astype(float), axis=1)
        self.tips = self.tips_in_tooth(attached)
        quadrant, place = divmod(self.result.get("tooth_fdi") or 36, 10)
        # y of tooth space runs toward distal, but toward mesial in the upper left and the lower right.
        self.distal = -1 if quadrant in (2, 4) else 1
        roles = self.role[self.before]
        self.decay, self.sound, self.vulnerable = (roles == name for name in ("decay", "sound", "vulnerable"))
        self.zones = {zone["id"]: (zone, self.zone(zone)) for zone in self.scenario.get("zones", [])}
        targets = [mask for zone, mask in self.zones.values() if zone["role"] == "target"]
        self.wanted = np.logical_or.reduce([self.decay, *targets])
        self.protected = {name: mask for name, (zone, mask) in self.zones.items() if zone["role"] == "never_remove"}
        cross = generate_binary_structure(3, 1)
        self.exposed = self.vulnerable & (self.removed | binary_dilation(self.removed, cross))

    def event(self, event):
        if "stage_started" in event:
            self.stage_spans.append([event["stage_started"]["stage"], event["tick"], None])
        if "stage_ended" in event and self.stage_spans:
            self.stage_spans[-1][2] = event["tick"]
        if "set_material" in event.get("command", {}):
            change = event["command"]["set_material"]
            self.changes.append((event["tick"], change["label"], change["like"]))

    def sites_of_draws(self, data):
        """Number of each possible site of a draw by its tissue's name, such as "caries:left-1"; no table has it."""
        header = data[:data.index(b"\n\n")].decode("latin1")
        segments = re.findall(r"^Segment(\d+)_ID:=(.*)$", header, re.M)
        sites = {name: int(re.search(rf"^Segment{n}_LabelValue:=(\d+)$", header, re.M)[1])
                 for n, name in segments if ":" in name}
        for name, number in sites.items():
            self.number[name] = number
            self.role[number] = self.role[self.number[name.partition(":")[0]]]
        return sites

    def sealed_changes(self):
        """The tissues of possible sites in a sealed session, whose recording has them not: drawn by its seed."""
        if self.result.get("seed_origin") != "sealed":
            return []
        changes = []
        for stage, tick, _ in self.stage_spans:
            written = [s for s in self.scenario["stages"] if stage == s["id"] or re.fullmatch(re.escape(s["id"]) + r"-\d+", stage)]
            if not written or "draw" not in written[0]:
                continue
            sites = written[0]["draw"]["one_of"]
            drawn = sites[seeded_random(self.result["seed"], f"{stage}/draw") % len(sites)]
            for name, number in self.sites.items():
                decay, _, site = name.partition(":")
                changes.append((tick, number, self.number[decay if site == drawn else "enamel"]))
        return changes

    def felt(self, number, tick):
        """Tissue that a touched one felt like: a possible site is caries in some trials, and enamel in the others."""
        alike = [like for at, label, like in self.changes if label == number and at <= tick]
        return alike[-1] if number in self.sites.values() and alike else number

    def removal_ticks(self):
        """Tick at which each voxel was removed; -1 where it was not."""
        seconds, origin, spacing = nrrd((self.bundle / "removal_time.nrrd").read_bytes())
        first = np.round((origin - self.origin) / spacing).astype(int)[::-1]
        fallen = np.full(self.before.shape, -1, np.int64)
        part = tuple(slice(at, at + size) for at, size in zip(first, seconds.shape))
        ticks = np.where(np.isnan(seconds), -0.001, seconds).astype(float)
        fallen[part] = np.round(ticks * 1000)
        return fallen

    def tips_in_tooth(self, attached):
        """Tips in tooth space: the device's middle is the middle of the crown, at the height of its highest point."""
        whole = self.before
        if "original.label.nrrd" in attached:
            labels, density = (nrrd(attached[f"original.{name}.nrrd"])[0] for name in ("label", "density"))
            whole = np.where(density > 127, labels, 0)
        cells = np.argwhere(whole == self.number["enamel"])[:, ::-1]
        low, high = (self.origin + self.spacing * extreme for extreme in (cells.min(0), cells.max(0)))
        middle = np.array([0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), high[2]])
        x, y, z = self.ticks["tip"].astype(float).T
        return middle + np.stack([-z, -x, y], axis=1)

    def places(self, mask):
        return self.origin + self.spacing * np.argwhere(mask)[:, ::-1]

    def cell(self, place):
        return tuple(np.round((np.array(place) - self.origin) / self.spacing).astype(int)[::-1])

    def zone(self, zone):
        """Voxels of a zone. Only sound tissue can be harmed: a protected zone has no decay but that which it names."""
        mask = self.region(zone["region"])
        is_protected = zone["role"] in ("never_remove", "container") and "tissue" not in zone["region"]
        return mask & ~self.decay if is_protected else mask

    def region(self, region):
        matter = self.before != 0
        [(kind, about)] = region.items()
        if kind == "tissue":
            return self.before == self.number[about]
        if kind == "around":
            core = self.before == self.number[about["tissue"]]
            mask = np.zeros_like(matter)
            if core.any():
                far, _ = cKDTree(self.places(core)).query(self.places(matter))
                mask[matter] = far <= about["within_mm"] + 1e-5
            return mask & ~core
        inside, mask = self.places(matter), np.zeros_like(matter)
        if kind == "sphere":
            mask[matter] = np.linalg.norm(inside - about["centre_mm"], axis=1) <= about["radius_mm"]
        elif kind == "box":
            mask[matter] = np.all((inside >= about["min_mm"]) & (inside <= about["max_mm"]), axis=1)
        elif kind == "cylinder":
            start, axis = np.array(about["from_mm"]), np.array(about["to_mm"]) - about["from_mm"]
            along = (inside - start) @ axis / (axis @ axis)
            off = np.linalg.norm(inside - start - np.outer(along, axis), axis=1)
            mask[matter] = (0 <= along) & (along <= 1) & (off <= about["radius_mm"])
        else:
            raise ValueError(f"no zone by {kind} here")
        return mask

    def walls(self, places, tree):
        """Distance of each place from the nearest of a set, and all walls that it may count to: of the nearest ones."""
        depths, _ = tree.query(places)
        walls = []
        for place, near in zip(places, tree.query_ball_point(places, depths + 1e-4)):
            offsets = place - tree.data[near]
            sizes = np.abs(offsets)
            names = set()
            for axis, (high, low) in enumerate([
                ("buccal", "lingual"), ("distal", "mesial") if self.distal > 0 else ("mesial", "distal"),
                ("occlusal", "apical"),
            ]):
                is_main = sizes[:, axis] >= sizes.max(axis=1) - 1e-4
                names |= {high if v > 0 else low for v in offsets[is_main, axis]}
            walls.append(names)
        return depths, walls


def is_equal(a, b, tolerance):
    return (a is None) == (b is None) and (a is None or abs(a - b) <= tolerance)


def check_bundle(bundle):
    session = Session(bundle)
    yield from removals(session)
    yield from of_voxels(session)
    yield from of_contact(session)
    yield from of_evidence(session)
    yield from sentences(session)


def removals(s):
    """When voxels were removed agrees with how many the recording says were removed in each tick, and with the tip."""
    ticks, counts = np.unique(s.fallen[s.fallen >= 0], return_counts=True)
    more = counts > s.ticks["removed"][ticks]
    if more.any():
        yield f"removal_time.nrrd: at tick {ticks[more][0]} more voxels than the recording has"
    if np.any(s.removed & (s.fallen < 0)):
        yield "removal_time.nrrd: a voxel is gone and has no time"
    cells = np.argwhere(s.fallen >= 0)
    if len(cells):
        places = s.origin + s.spacing * cells[:, ::-1]
        off = np.linalg.norm(places - s.tips[s.fallen[tuple(cells.T)]], axis=1)
        # No working end of a bur or an excavator is longer.
        if off.max() > 5.0:
            yield f"removal_time.nrrd: a voxel was removed {off.max():.2f} mm from the tip"


def episodes_of(s, kind):
    return [episode for episode in s.result.get("episodes", []) if episode["kind"] == kind]


def of_voxels(s):
    """Episodes of tissue that was removed, exposed or left."""
    leeway = s.scenario.get("measures", {}).get("leeway_mm", 0.3)
    wanted_tree = cKDTree(s.places(s.wanted)) if s.wanted.any() else None
    forbidden = np.logical_or.reduce([np.zeros_like(s.removed), *s.protected.values()])
    overcut = s.removed & ~s.wanted & ~s.exposed & ~forbidden
    if overcut.any() and wanted_tree is not None:
        by_role = lambda role: np.logical_or.reduce(
            [np.zeros_like(s.removed), *(mask for zone, mask in s.zones.values() if zone["role"] == role)])
        near = np.zeros_like(overcut)
        near[overcut] = wanted_tree.query(s.places(overcut))[0] <= leeway + 1e-5
        overcut &= by_role("container") | ~(near | by_role("leeway"))
    times = s.fallen.astype(float) / 1000
    yield from grouped(s, "overcut", None, overcut, times, wanted_tree)
    exposing = exposure_times(s)
    yield from grouped(s, "vulnerable", None, s.exposed, exposing, wanted_tree)
    for name, mask in s.protected.items():
        yield from grouped(s, "zone", name, mask & s.removed, times, wanted_tree)
    # Where nothing is cut, and at the possible sites of draws, caries is to be found and not to be removed.
    is_cut = any(stage.get("cutting") for stage in s.scenario["stages"])
    left = s.wanted & ~s.removed & ~s.exposed & ~np.isin(s.before, list(s.sites.values())) & is_cut
    removed_tree = cKDTree(s.places(s.removed)) if s.removed.any() else None
    yield from grouped(s, "left", None, left, None, removed_tree)


def exposure_times(s):
    """Second at which each vulnerable voxel was exposed: when it or a neighbour was removed."""
    never = 10 ** 12
    fallen = np.where(s.removed & (s.fallen >= 0), s.fallen, never)
    earliest = fallen.copy()
    for axis in range(3):
        for step in (1, -1):
            moved = np.roll(fallen, step, axis)
            edge = [slice(None)] * 3
            edge[axis] = 0 if step == 1 else -1
            moved[tuple(edge)] = never
            earliest = np.minimum(earliest, moved)
    return np.where(s.exposed, earliest, -1) / 1000


def grouped(s, kind, zone, mask, times, tree):
    """Compares the episodes of a kind with the voxels that belong to them."""
    told = [episode for episode in episodes_of(s, kind) if episode.get("zone") == zone]
    if not mask.any():
        if told:
            yield f"{kind} {zone or ''}: {len(told)} episodes without a voxel"
        return
    cells = np.argwhere(mask)
    places, tissues = s.places(mask), s.before[mask]
    when = None if times is None else times[mask]
    depths, walls = s.walls(places, tree) if tree is not None else (np.full(len(places), np.nan), [{None}] * len(places))
    names = {number: name for name, number in s.number.items()}
    covered = np.zeros(len(places), bool)
    for episode in told:
        about = f"{kind} episode of {episode['tissue']} at {episode.get('at_s')} s, {episode.get('wall')}"
        number, wall = s.number[episode["tissue"]], episode.get("wall")
        may = (tissues == number) & np.array([wall in found for found in walls])
        must = may & np.array([len(found) == 1 for found in walls])
        start, end = episode.get("from_s"), episode.get("to_s")
        if when is not None:
            within = (when >= start - 1e-6) & (when <= end + 1e-6)
            for beside in (must & (when < start - 1e-6) & (when > start - CUTTING_PAUSE + 0.002),
                           must & (when > end + 1e-6) & (when < end + CUTTING_PAUSE - 0.002)):
                if beside.any():
                    yield f"{about}: more was removed at that wall at {when[beside][0]} s"
            may, must = may & within, must & within
        covered |= may
        low, high = must.sum() * s.voxel_mm3 - 1e-6, may.sum() * s.voxel_mm3 + 1e-6
        if not low <= episode["volume_mm3"] <= high:
            yield f"{about}: {episode['volume_mm3']} mm³, the label maps give {low:.4f} to {high:.4f}"
            continue
        here = np.all(cells == s.cell(episode["place_mm"]), axis=1) & may
        if here.sum() != 1:
            yield f"{about}: its place {episode['place_mm']} has another tissue, wall or time: {names.get(s.before[s.cell(episode['place_mm'])])}"
            continue
        [index] = np.flatnonzero(here)
        if np.abs(places[index] - episode["place_mm"]).max() > MM:
            yield f"{about}: its place is no voxel's centre"
        if tree is not None and not is_equal(episode.get("depth_mm"), depths[index], MM):
            yield f"{about}: {episode.get('depth_mm')} mm deep, its place lies {depths[index]} mm from the tissue"
        if kind in ("overcut", "left") and must.any() and depths[must].max() > depths[index] + MM:
            yield f"{about}: not the deepest place, there is one of {depths[must].max()} mm"
        if when is None:
            continue
        if not is_equal(episode["at_s"], when[index], 1e-6):
            yield f"{about}: its place was removed at {when[index]} s"
        if kind in ("vulnerable", "zone") and not is_equal(episode["at_s"], start, 1e-6):
            yield f"{about}: it began at {start} s"
        tick_forces = s.force[np.round(when * 1000).astype(int).clip(0, len(s.force) - 1)]
        if not is_equal(episode["force_at_n"], tick_forces[index], NEWTON):
            yield f"{about}: {episode['force_at_n']} N, the recording has {tick_forces[index]} N"
        low = tick_forces[must].max() if must.any() else 0.0
        if not low - NEWTON <= episode["force_n"] <= tick_forces[may].max() + NEWTON:
            yield f"{about}: up to {episode['force_n']} N, the recording has {tick_forces[may].max()} N"
    if len(episodes_of(s, kind)) < EPISODES_MAX and kind not in ("overcut", "left") and not covered.all():
        yield f"{kind} {zone or ''}: {np.count_nonzero(~covered)} voxels are in no episode"


def spells_of(s, is_meant):
    """Spells of contact with each tissue: (tissue, first tick, last tick, number of ticks, tick of the greatest force)."""
    for number in np.unique(s.ticks["touched"][is_meant]):
        at = np.flatnonzero(is_meant & (s.ticks["touched"] == number))
        for spell in np.split(at, np.flatnonzero(np.diff(at) > CONTACT_GAP) + 1):
            yield number, spell[0], spell[-1], len(spell), spell[np.argmax(s.force[spell])]


def of_contact(s):
    """Episodes of force, and of a running bur on an adjacent tooth or on soft tissue."""
    touched = s.ticks["touched"] != 0
    rubric = s.scenario.get("rubric") or {"items": [], "hard_fails": []}
    limits = [item["full_at"] for item in rubric["items"] if item["metric"] == "force_max_n"]
    limits += [fail["when"]["above"] for fail in rubric.get("hard_fails", [])
               if fail["metric"] == "force_max_n" and "above" in fail["when"]]
    # The exercise's own guidance is part of the recorded force and no part of the trainee's.
    is_guided = any("guidance" in stage for stage in s.scenario["stages"])
    if not is_guided:
        hard = touched & (s.force > min(limits)) if limits else np.zeros_like(touched)
        yield from contact(s, "force", hard)
    cutting = {stage["id"] for stage in s.scenario["stages"] if stage.get("cutting")}
    running = np.zeros_like(touched)
    for stage, start, end in s.stage_spans:
        if stage in cutting:
            running[start:end] = True
    running &= s.is_bur[s.ticks["instrument"]]
    roles = s.role[s.ticks["touched"]]
    yield from contact(s, "neighbour", touched & running & (roles == "neighbour"))
    yield from contact(s, "soft", touched & running & (roles == "soft"))


def contact(s, kind, is_meant):
    told = {(episode["tissue"], round(1000 * episode["from_s"])): episode for episode in episodes_of(s, kind)}
    names = {number: name for name, number in s.number.items()}
    spells = list(spells_of(s, is_meant))
    if min(len(spells), EPISODES_MAX) != len(told):
        yield f"{kind}: {len(told)} episodes, the recording has {len(spells)} spells"
    for number, first, last, count, peak in spells:
        name = names.get(s.felt(number, peak))
        episode = told.pop((name, first), None)
        if episode is None:
            if len(spells) <= EPISODES_MAX:
                yield f"{kind}: contact with {name} from {first / 1000} s is in no episode"
            continue
        about = f"{kind} episode of {episode['tissue']} from {episode['from_s']} s"
        wanted = {"to_s": last / 1000, "contact_s": count / 1000, "at_s": peak / 1000, "force_n": s.force[peak],
                  "force_at_n": s.force[peak]}
        for key, value in wanted.items():
            tied = key == "at_s" and abs(s.force[round(1000 * episode[key])] - s.force[peak]) <= NEWTON
            if not tied and not is_equal(episode[key], value, NEWTON):
                yield f"{about}: {key} is {episode[key]}, the recording gives {value}"
        if np.abs(s.tips[round(1000 * episode["at_s"])] - episode["place_mm"]).max() > 1e-3:
            yield f"{about}: the tip was at {s.tips[peak]}, not at {episode['place_mm']}"
    for episode in told.values():
        yield f"{kind} episode of {episode['tissue']} from {episode['from_s']} s: the recording has no such contact"


def of_evidence(s):
    """The evidence of measures that sentences state."""
    evidence, metrics = s.result["evidence"], s.result["metrics"]
    vulnerable = cKDTree(s.places(s.vulnerable)) if s.vulnerable.any() else None

    def distance(name, of, start, is_farthest, has_wall):
        value = metrics.get(name)
        if not of.any() or not start.any():
            return
        tree = cKDTree(s.places(start))
        depths, _ = tree.query(s.places(of))
        extreme = depths.max() if is_farthest else depths.min()
        if not is_equal(value, extreme, MM):
            yield f"{name}: {value} mm, the label maps give {extreme}"
            return
        told = evidence[name]
        cell = s.cell(told["place_mm"])
        depth, [walls] = s.walls(np.array([told["place_mm"]]), tree)
        if not of[cell] or abs(depth[0] - extreme) > MM or not is_equal(told["depth_mm"], extreme, MM):
            yield f"{name}: its place {told['place_mm']} lies at {depth[0]} mm, not at {extreme}"
        if s.number.get(told["tissue"]) != s.before[cell]:
            yield f"{name}: {told['tissue']} at a place of tissue {s.before[cell]}"
        if has_wall and told["wall"] not in walls:
            yield f"{name}: the {told['wall']} wall, its place lies at {walls}"
        if s.removed[cell]:
            first = s.fallen[of & s.removed][np.abs(depths[s.removed[of]] - extreme) <= 1e-4].min()
            if not is_equal(told["at_s"], first / 1000, 1e-6) or s.fallen[cell] != first:
                yield f"{name}: at {told['at_s']} s, removed at {first / 1000} s"
            if not is_equal(told["force_n"], s.force[first], NEWTON):
                yield f"{name}: {told['force_n']} N, the recording has {s.force[first]} N"

    yield from distance("overcut_depth_max_mm", s.removed & s.sound, s.decay, True, True)
    yield from distance("undercut_depth_max_mm", s.decay & ~s.removed, s.removed, True, True)
    yield from distance("remaining_dentine_thickness_min_mm", s.removed & ~s.vulnerable, s.vulnerable, False, False)
    told = evidence.get("pulp_exposed")
    if bool(metrics.get("pulp_exposed")) != bool(s.exposed.any()) or (told is not None) != bool(s.exposed.any()):
        yield f"pulp_exposed: {metrics.get('pulp_exposed')}, exposed voxels: {s.exposed.sum()}"
    elif told is not None:
        times = exposure_times(s)
        first, cell = times[s.exposed].min(), s.cell(told["place_mm"])
        volume = np.count_nonzero(s.vulnerable & s.removed) * s.voxel_mm3
        if not is_equal(told["at_s"], first, 1e-6) or not is_equal(times[cell], first, 1e-6):
            yield f"pulp_exposed: at {told['at_s']} s, the first voxel was exposed at {first} s"
        if not s.exposed[cell] or s.number[told["tissue"]] != s.before[cell]:
            yield f"pulp_exposed: nothing was exposed at {told['place_mm']}"
        if not is_equal(told["force_n"], s.force[round(first * 1000)], NEWTON):
            yield f"pulp_exposed: {told['force_n']} N, the recording has {s.force[round(first * 1000)]} N"
        if not is_equal(told["volume_mm3"], volume, 1e-6):
            yield f"pulp_exposed: {told['volume_mm3']} mm³, the label maps give {volume}"
    if any("guidance" in stage for stage in s.scenario["stages"]):
        return
    touched = s.ticks["touched"] != 0
    near = np.zeros_like(touched)
    if vulnerable is not None:
        cells = np.floor((s.tips - s.origin) / s.spacing + 0.5)
        inside = np.all((cells >= 0) & (cells < np.array(s.before.shape)[::-1]), axis=1)
        far, _ = vulnerable.query(s.origin + s.spacing * cells)
        near = inside & (far <= s.scenario.get("measures", {}).get("near_mm", 1.0) + 1e-5)
    for name, is_meant in (("force_max_n", touched), ("force_max_near_pulp_n", touched & near)):
        told = evidence.get(name)
        if told is None or not is_meant.any():
            continue
        peak = round(told["at_s"] * 1000)
        highest = s.force[is_meant].max()
        # The program also counts contact with matter too thin to have a tissue.
        if s.ticks["touched"][peak] == 0:
            continue
        if not is_equal(metrics[name], highest, NEWTON) or not is_equal(s.force[peak], highest, NEWTON):
            yield f"{name}: {metrics[name]} N at {told['at_s']} s, the recording has {highest} N"
        if s.number.get(told.get("tissue")) != s.felt(s.ticks["touched"][peak], peak):
            yield f"{name}: on {told.get('tissue')}, the recording has tissue {s.ticks['touched'][peak]}"
        if np.abs(s.tips[peak] - told["place_mm"]).max() > 1e-3:
            yield f"{name}: the tip was at {s.tips[peak]}, not at {told['place_mm']}"


def duration(text):
    minutes, _, seconds = text.replace(" s", "").rpartition(":")
    return 60 * float(minutes or 0) + float(seconds)


def sentences(s):
    """Every sentence with a mark says what its one episode or evidence says."""
    page = (s.bundle / "report.html").read_text()
    data = re.search(r'<script[^>]*id="session"[^>]*>(.*?)</script>', page, re.S)
    moments = {m["number"]: m for m in json.loads(data[1])["moments"]} if data else {}
    feedback = re.search(r'<ol class="feedback">(.*?)</ol>', page, re.S)
    s.told = 0
    if not feedback:
        return
    for finding in re.split(r"<li>", feedback[1])[1:]:
        metric = html.unescape(re.search(r"<code>(.*?)</code>", finding)[1])
        for text, mark in re.findall(r'<p>(.*?)(?: <button[^>]*data-mark="(\d+)".*?</button>)?</p>', finding, re.S):
            english = re.search(r'<span lang="en">(.*?)</span>', text, re.S)
            said = html.unescape(re.sub("<[^>]*>", "", english[1] if english else text)).replace("\u00a0", " ")
            if not mark:
                continue
            s.told += 1
            yield from (f"“{said}”: {why}" for why in sentence(s, metric, said, moments[int(mark)]))


def sentence(s, metric, said, moment):
    sources = [*s.result.get("episodes", []), *filter(None, [s.result["evidence"].get(metric)])]
    is_source = lambda source: source["place_mm"] == moment["place"] and source.get("at_s") == moment["at"]
    sources = [source for source in sources if is_source(source)]
    complaints = [list(differences(s, metric, said, source)) for source in sources]
    if not complaints:
        yield f"no episode and no evidence at {moment}"
    elif all(complaints):
        yield from min(complaints, key=len)


def differences(s, metric, said, source):
    """What a sentence says that its source does not."""
    said = re.sub(r"“.*?”", "", said)
    criterion = re.search(r"criterion: (.*?)\)", said)
    body = said.replace(criterion[1], "") if criterion else said
    value = s.result["metrics"].get(metric)
    known = {
        "mm³": [source.get("volume_mm3")], "N": [source.get("force_n"), source.get("force_at_n"), value],
        "mm": [source.get("depth_mm"), value],
    }
    for number, unit in re.findall(r"(\d+(?:\.\d+)?) (mm³|mm\b(?!/)|N\b)", body):
        half = 0.5000001 * 10.0 ** -len(number.partition(".")[2])
        if not any(v is not None and abs(v - float(number)) <= half for v in known[unit]):
            yield f"{number} {unit} is not in its evidence {known[unit]}"
    times = [source.get(key) for key in ("at_s", "from_s", "to_s", "contact_s")] + [value]
    for text in re.findall(r"\d+:\d\d\.\d|\d+\.\d+ s\b", body):
        if not any(t is not None and abs(t - duration(text)) <= 0.0500001 for t in times):
            yield f"{text} is not in its evidence {times}"
    for words, wall in WALLS.items():
        if words in body and source.get("wall") != wall:
            yield f"it names the {wall} wall, its evidence {source.get('wall')}"
    if source.get("wall") and metric not in ("pulp_exposed",) and not any(words in body for words in WALLS) and "zone" not in body:
        yield f"it names no wall, its evidence {source['wall']}"
    tissue = source.get("tissue")
    named = [name for name, title in s.title.items() if re.search(rf"\b{re.escape(title)}\b", body)]
    named = [name for name in named if not any(name != other and s.title[name] in s.title[other] for other in named)]
    # "Beyond the caries" and "near the pulp" name where a distance begins, not what was touched.
    stated = [name for name in named if not re.search(rf"(beyond the|near the|of the) {s.title[name]}", body.lower())]
    if any(name != tissue for name in stated):
        yield f"it names {stated}, its evidence {tissue}"


def main(bundles):
    count, episodes, told, wrong = 0, 0, 0, 0
    for bundle in map(pathlib.Path, bundles):
        for difference in check_bundle(bundle):
            print(f"{bundle.name}: {difference}")
            wrong += 1
        result = json.loads((bundle / "session.json").read_text())
        page = (bundle / "report.html").read_text()
        count, episodes = count + 1, episodes + len(result.get("episodes", []))
        told += len(set(re.findall(r'class="show[^"]*" data-mark="(\d+)"', page)))
    print(f"{count} sessions, {episodes} episodes, {told} moments told, {wrong} differences")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
