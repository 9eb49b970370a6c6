"""Reads a session's bundle with programs that share no code with typodont, and derives its numbers again.

    read_bundle.py BUNDLE

SimpleITK: the tissues before and after give the decay cleared and the sound tissue lost. slicerio: the performance map has
names and colours, and each verdict as many voxels as it must. mcap: the recording's ticks decode as ROS 2 messages and add
up to the time and the force of `session.json`. Exits with 1 and a line per difference.
"""

import json
import pathlib
import sys

import mcap.reader
import mcap_ros2.decoder
import numpy
import SimpleITK
import slicerio

#: How far a percentage derived here may differ from the one in `session.json`.
TOLERANCE = 0.01

#: Decay, by the name its segment has in the shipped table.
DECAY = "caries"


def main(arguments):
    [bundle] = map(pathlib.Path, arguments)
    session = json.loads((bundle / "session.json").read_text())
    differences = [*shares(bundle, session["metrics"]), *verdicts(bundle), *recording(bundle, session)]
    differences += points(session)
    for difference in differences:
        print(difference)
    return 1 if differences else 0


def labels(path):
    """The label map, and the label of each segment by its identifier."""
    image = SimpleITK.ReadImage(str(path))
    keys = image.GetMetaDataKeys()
    count = sum(1 for key in keys if key.startswith("Segment") and key.endswith("_ID"))
    value = {image.GetMetaData(f"Segment{i}_ID"): int(image.GetMetaData(f"Segment{i}_LabelValue")) for i in range(count)}
    return SimpleITK.GetArrayFromImage(image), value


def shares(bundle, metrics):
    before, values = labels(bundle / "initial.seg.nrrd")
    after, _ = labels(bundle / "final.seg.nrrd")
    removed = (before != 0) & (after == 0)
    decay = before == values[DECAY]
    whole = numpy.count_nonzero(decay)
    derived = {
        "decay_cleared_pct": 100 * numpy.count_nonzero(removed & decay) / whole,
        "healthy_per_decay_pct": 100 * numpy.count_nonzero(removed & ~decay) / whole,
    }
    for name, value in derived.items():
        print(f"{name}: {value:.4f} from the label maps, {metrics[name]:.4f} in session.json", file=sys.stderr)
        if abs(value - metrics[name]) > TOLERANCE:
            yield f"{name}: the label maps give {value}, session.json says {metrics[name]}"


def verdicts(bundle):
    path = bundle / "performance.seg.nrrd"
    segmentation = slicerio.read_segmentation(str(path))
    before, _ = labels(bundle / "initial.seg.nrrd")
    after, _ = labels(bundle / "final.seg.nrrd")
    seen, values = labels(path)
    if not segmentation["segments"]:
        yield "performance.seg.nrrd: no segments"
    for segment in segmentation["segments"]:
        if not segment["name"] or len(segment["color"]) != 3:
            yield f"performance.seg.nrrd: a segment without name or colour: {segment}"
    if not numpy.array_equal(seen != 0, before != 0):
        yield "performance.seg.nrrd: a voxel of the tooth has no verdict, or one of the air has"
    gone = {"rightly_removed", "within_leeway", "overcut"}
    for name, value in values.items():
        if name in gone and not numpy.all(after[seen == value] == 0):
            yield f"performance.seg.nrrd: {name} holds matter that is still there"
        if name in {"left", "kept_sound", "kept"} and not numpy.all(after[seen == value] != 0):
            yield f"performance.seg.nrrd: {name} holds matter that is gone"


def points(session):
    """The points of each item, from its value, and their sum."""
    grade = session["grade"]

    def share(item):
        if item["value"] is None:
            return 0.0
        full, zero = item["full_at"], item["zero_at"]
        return min(max((item["value"] - zero) / (full - zero), 0.0), 1.0)

    shares = {item["metric"]: share(item) for item in grade["items"] if "counts_with" not in item}
    for item in grade["items"]:
        factor = 1.0
        if "counts_with" in item:
            factor = shares[item["counts_with"]]
            if abs(factor - item["counts_with_share"]) > 1e-6:
                yield f"{item['title']}: counts with a share of {factor}, session.json says {item['counts_with_share']}"
        derived = share(item) * factor * item["max_points"]
        if abs(derived - item["points"]) > 1e-6:
            yield f"{item['title']}: {derived} points, session.json says {item['points']}"
    total = sum(item["points"] for item in grade["items"])
    if abs(total - grade["points"]) > 1e-6:
        yield f"the items sum to {total} points, session.json says {grade['points']}"


def recording(bundle, session):
    ticks, strongest = 0, 0.0
    with open(bundle / "recording.mcap", "rb") as file:
        reader = mcap.reader.make_reader(file, decoder_factories=[mcap_ros2.decoder.DecoderFactory()])
        for _, _, message, haptic in reader.iter_decoded_messages(topics=["/haptic"]):
            if haptic.tick != ticks:
                yield f"recording.mcap: tick {haptic.tick} where {ticks} was due"
                return
            if message.log_time != ticks * 1_000_000:
                yield f"recording.mcap: tick {ticks} is logged at {message.log_time} ns"
                return
            if haptic.touched:
                strongest = max(strongest, float(numpy.linalg.norm(haptic.force_n)))
            ticks += 1
        names = {attachment.name for attachment in reader.iter_attachments()}
    if "scenario.json" not in names:
        yield f"recording.mcap: no scenario among {sorted(names)}"
    metrics = session["metrics"]
    if abs(ticks / 1000 - metrics["session_time_s"]) > 1e-6:
        yield f"recording.mcap: {ticks} ticks, but a session of {metrics['session_time_s']} s"
    if abs(strongest - metrics["force_max_n"]) > 1e-4:
        yield f"recording.mcap: {strongest} N at most, but {metrics['force_max_n']} N in session.json"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
