"""Derives again which voxels were removed out of the trainee's sight, by densely sampled lines of sight.

    check_visibility.py RECORDING FOUND

RECORDING is a recording.mcap, from which the views and the tooth at the start are read. FOUND is a JSON file with `removed`
(voxel and tick of each removal), `hidden` (the voxels that typodont judged as hidden) and `ball` (centre and radius of an
obstacle in tooth space, or null). typodont walks from voxel to voxel; here points are sampled every twentieth of a voxel.
Prints the shares and exits with 1 if more than 1 % of the removed voxels are judged differently.
"""

import json
import sys

import mcap.reader
import numpy as np
from check_feedback import nrrd

#: Share of the removed voxels that may be judged differently: points that graze the edge of a voxel.
TOLERANCE = 0.01

#: Length of a line next to the removed voxel on which nothing hides it, mm, as the measure's definition says.
SKIN = 0.5


class Tooth:
    def __init__(self, attached, enamel):
        density, self.origin, self.spacing = nrrd(attached["initial.density.nrrd"])
        labels, _, _ = nrrd(attached["initial.label.nrrd"])
        self.solid = density > 127
        cells = np.argwhere(self.solid & (labels == enamel))[:, ::-1]
        low, high = (self.origin + self.spacing * extreme for extreme in (cells.min(0), cells.max(0)))
        #: The device's middle is the middle of the crown, at the height of its highest point.
        self.anchor = np.array([0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), high[2]])

    def direction(self, in_world):
        x, y, z = in_world
        return np.array([-z, -x, y])

    def point(self, in_world):
        return self.anchor + self.direction(in_world)


class View:
    def __init__(self, tick, file, tooth):
        self.tick, self.eye = tick, tooth.point(file["eye_mm"])
        forward = tooth.point(file["focus_mm"]) - self.eye
        self.forward = forward / np.linalg.norm(forward)
        right = np.cross(self.forward, tooth.direction(file["up"]))
        self.right = right / np.linalg.norm(right)
        self.up = np.cross(self.right, self.forward)
        self.half = file["half_extent"]
        mirror = file.get("mirror")
        self.mirror = mirror and (tooth.point(mirror["centre_mm"]), tooth.direction(mirror["normal"]), mirror["radius_mm"])

    def contains(self, point):
        across, upward, depth = ((point - self.eye) @ axis for axis in (self.right, self.up, self.forward))
        return depth > 0 and abs(across / depth) <= self.half[0] and abs(upward / depth) <= self.half[1]


def is_free(start, end, skin, is_solid, tooth, ball):
    """Whether no sample of the line lies in a solid voxel or in the ball."""
    length = np.linalg.norm(end - start)
    if length <= skin:
        return True
    step = 0.05 * tooth.spacing.min()
    along = np.arange(skin, length, step)
    points = start + np.outer(along, (end - start) / length)
    if ball and (np.linalg.norm(points - ball["centre"], axis=1) < ball["radius"]).any():
        return False
    cells = np.round((points - tooth.origin) / tooth.spacing).astype(int)[:, ::-1]
    inside = ((cells >= 0) & (cells < is_solid.shape)).all(1)
    return not is_solid[tuple(cells[inside].T)].any()


def is_visible(place, view, is_solid, tooth, ball):
    free = lambda start, end, skin: is_free(start, end, skin, is_solid, tooth, ball)
    if view.mirror is None:
        return view.contains(place) and free(place, view.eye, SKIN)
    centre, normal, radius = view.mirror
    height, eye_height = (place - centre) @ normal, (view.eye - centre) @ normal
    direct = place + (view.eye - place) * (height / (height - eye_height)) if height * eye_height < 0 else None
    is_behind_mirror = direct is not None and np.linalg.norm(direct - centre) <= radius
    if not is_behind_mirror and view.contains(place) and free(place, view.eye, SKIN):
        return True
    if height <= 0 or eye_height <= 0:
        return False
    # Light from the place meets the face where both triangles over it are similar.
    foot, eye_foot = place - height * normal, view.eye - eye_height * normal
    on_face = (foot * eye_height + eye_foot * height) / (height + eye_height)
    if np.linalg.norm(on_face - centre) > radius or not view.contains(on_face):
        return False
    return free(place, on_face, SKIN) and free(view.eye, on_face, 0.0)


def main(recording, found):
    attached, looks = {}, []
    with open(recording, "rb") as file:
        reader = mcap.reader.make_reader(file)
        attached = {attachment.name: attachment.data for attachment in reader.iter_attachments()}
        for _, _, message in reader.iter_messages(topics=["/event"]):
            event = json.loads(message.data)
            if "look" in event.get("input", {}):
                looks.append((event["tick"], event["input"]["look"]))
    table = json.loads(attached["content/tissues.json"])["tissues"]
    tooth = Tooth(attached, next(tissue["id"] for tissue in table if tissue["name"] == "enamel"))
    views = [View(tick, look, tooth) for tick, look in looks]
    found = json.load(open(found))
    claimed = set(found["hidden"])
    removals = sorted((tick, voxel) for voxel, tick in found["removed"])
    deep, high, wide = tooth.solid.shape
    is_solid, gone, hidden, differing = tooth.solid.copy(), 0, 0, 0
    for tick, voxel in removals:
        while gone < len(removals) and removals[gone][0] <= tick:
            is_solid.reshape(-1)[removals[gone][1]] = False
            gone += 1
        cell = np.array([voxel % wide, voxel // wide % high, voxel // (wide * high)])
        view = [view for view in views if view.tick <= tick][-1]
        is_hidden = not is_visible(tooth.origin + tooth.spacing * cell, view, is_solid, tooth, found["ball"])
        hidden += is_hidden
        differing += is_hidden != (voxel in claimed)
    print(f"{len(removals)} removed, {hidden} hidden here, {len(claimed)} in typodont, {differing} judged differently")
    return 1 if not removals or differing > TOLERANCE * len(removals) else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
