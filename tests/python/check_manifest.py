"""Whether the manifest of a package for learning platforms is valid against the schemas of its standard.

    check_manifest.py PACKAGE STANDARD [SCHEMAS]

PACKAGE is a folder with the archive's files, STANDARD one of 1.2, 2004 and cmi5, SCHEMAS the folder with ADL's XSD files by edition.
For cmi5, whose schema is not among them, the rules of chapter 13 of its specification are checked one by one. Prints one line for
each fault.
"""

import pathlib
import sys
import urllib.parse

from lxml import etree

CMI5 = "{https://w3id.org/xapi/profiles/cmi5/v1/CourseStructure.xsd}"
EDITIONS = {
    "1.2": ("scorm12edition", "http://www.imsproject.org/xsd/imscp_rootv1p1p2", ["imscp_rootv1p1p2.xsd", "adlcp_rootv1p2.xsd"]),
    "2004": ("scorm20044thedition", "http://www.imsglobal.org/xsd/imscp_v1p1", ["imscp_v1p1.xsd", "adlcp_v1p3.xsd", "imsss_v1p0.xsd"]),
}


def schema(folder, files):
    """One schema of several files."""
    names = {name: etree.parse(str(folder / name)).getroot().get("targetNamespace") for name in files}
    imports = "".join(f'<xs:import namespace="{space}" schemaLocation="{(folder / name).as_uri()}"/>' for name, space in names.items())
    root = etree.fromstring(f'<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema">{imports}</xs:schema>')
    return etree.XMLSchema(root)


def scorm(package, standard, schemas):
    edition, space, files = EDITIONS[standard]
    manifest = etree.parse(str(package / "imsmanifest.xml"))
    xsd = schema(schemas / edition, files)
    if not xsd.validate(manifest):
        yield from (f"line {e.line}: {e.message}" for e in xsd.error_log)
    # What a schema cannot say: every file is there, and every file of the archive is listed.
    listed = {urllib.parse.unquote(e.get("href").split("?")[0]) for e in manifest.iter(f"{{{space}}}file", f"{{{space}}}resource") if e.get("href")}
    there = {str(path.relative_to(package)) for path in package.rglob("*") if path.is_file()}
    yield from (f"{name} is listed and not there" for name in sorted(listed - there))
    yield from (f"{name} is not listed" for name in sorted(there - listed - {"imsmanifest.xml"}))
    resources = {e.get("identifier") for e in manifest.iter(f"{{{space}}}resource")}
    items = [e.get("identifierref") for e in manifest.iter(f"{{{space}}}item")]
    if not items or not set(items) <= resources:
        yield f"items {items} of resources {resources}"


def cmi5(package):
    root = etree.parse(str(package / "cmi5.xml")).getroot()
    if root.tag != CMI5 + "courseStructure" or [e.tag for e in root][:1] != [CMI5 + "course"]:
        yield f"the root is {root.tag}"
    units = root.findall(CMI5 + "au")
    if not units:
        yield "there is no assignable unit"
    ids = [e.get("id") for e in [root.find(CMI5 + "course"), *units]]
    if len(set(ids)) != len(ids):
        yield f"ids are not unique: {ids}"
    yield from (f"{name} is no IRI" for name in ids if not urllib.parse.urlparse(name or "").scheme)
    for unit in units:
        order = [e.tag.removeprefix(CMI5) for e in unit]
        if order != ["title", "description", "url"]:
            yield f"a unit has {order}"
        if unit.get("moveOn") not in {"NotApplicable", "Passed", "Completed", "CompletedAndPassed", "CompletedOrPassed"}:
            yield f"moveOn is {unit.get('moveOn')}"
        if unit.get("launchMethod") not in {"OwnWindow", "AnyWindow"}:
            yield f"launchMethod is {unit.get('launchMethod')}"
        page = unit.findtext(CMI5 + "url").split("?")[0]
        if not (package / page).is_file():
            yield f"{page} is not there"
        for text in unit.iter(CMI5 + "langstring"):
            if not text.get("lang"):
                yield "a text has no language"


def main(arguments):
    package, standard = pathlib.Path(arguments[0]), arguments[1]
    faults = list(cmi5(package) if standard == "cmi5" else scorm(package, standard, pathlib.Path(arguments[2]).resolve()))
    print("\n".join(faults))
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
