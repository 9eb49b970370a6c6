"""Writes one volume as other programs have it: ITK's NIfTI and MetaImage, and GDCM's DICOM series, plain and compressed.

Each voxel holds x + 10 y + 100 z of its place in millimetres (left, posterior, superior), rounded, so that whoever reads
it knows where it belongs.
"""

import sys
from pathlib import Path

import SimpleITK as sitk

folder = Path(sys.argv[1])
spacing, origin = (0.5, 0.25, 2.0), (-3.0, 4.0, 10.0)


def volume(direction):
    image = sitk.Image(7, 6, 5, sitk.sitkInt16)
    image.SetSpacing(spacing)
    image.SetOrigin(origin)
    image.SetDirection(direction)
    for k in range(5):
        for j in range(6):
            for i in range(7):
                x, y, z = image.TransformIndexToPhysicalPoint((i, j, k))
                image[i, j, k] = round(x + 10 * y + 100 * z)
    return image


STRAIGHT = (1, 0, 0, 0, 1, 0, 0, 0, 1)
# Columns are where the array's axes run: back, up, to the left.
TURNED = (0, 0, 1, 1, 0, 0, 0, 1, 0)

for name, direction in (("straight", STRAIGHT), ("turned", TURNED)):
    image = volume(direction)
    for ending, compress in (("nii", False), ("nii.gz", True), ("mha", True), ("mhd", False)):
        sitk.WriteImage(image, str(folder / f"{name}.{ending}"), compress)
    sitk.WriteImage(image, str(folder / f"{name}_zipped.mhd"), True)
    for way in ("plain", "JPEG", "JPEG2000"):
        series = folder / f"{name}_{way}"
        series.mkdir()
        for k in range(5):
            cut = image[:, :, k]
            writer = sitk.ImageFileWriter()
            writer.KeepOriginalImageUIDOn()
            if way != "plain":
                writer.UseCompressionOn()
                writer.SetCompressor(way)
            place = image.TransformIndexToPhysicalPoint((0, 0, k))
            d = image.GetDirection()
            tags = {
                "0008|0060": "CT",
                "0008|0016": "1.2.840.10008.5.1.4.1.1.2",
                "0008|0018": f"1.2.3.4.{k + 1}",
                "0020|000e": "1.2.3.4",
                "0020|000d": "1.2.3",
                "0020|0013": str(5 - k),
                "0020|0032": "\\".join(f"{v:g}" for v in place),
                "0020|0037": "\\".join(f"{d[n]:g}" for n in (0, 3, 6, 1, 4, 7)),
                "0028|1052": "0",
                "0028|1053": "1",
            }
            for tag, value in tags.items():
                cut.SetMetaData(tag, value)
            writer.SetFileName(str(series / f"{(3 * k + 2) % 5}.dcm"))
            writer.Execute(cut)
