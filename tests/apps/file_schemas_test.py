"""Schemas and readers of YAML files say the same.

Every shipped file is taken by both. Then each is spoilt in every way below, one place at a time, and given to the schema
and to the program's own reader. What the schema refuses the reader must refuse, always; what the reader refuses the schema
must refuse, but for the checks of ONLY_READERS, which no schema can do.

    file_schemas_test.py TOUCHSTONE READ_YAML_FILES SOURCE_FOLDER
"""
import collections
import copy
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

try:
    import jsonschema
    import yaml
except ImportError as error:
    sys.exit(f"{error}: apt-get install python3-jsonschema python3-yaml (script/packages.txt)")

# What readers find wrong and schemas don't: one value against another, or against a file. Each must be met at least once.
ONLY_READERS = [
    r"background: .*: (is for coated gels|needs a camera)",
    # files that aren't there
    r"there is no file", r"can't be read",
    # bounds that another field gives
    *(rf"{field}: \S+ is not allowed; allowed is" for field in (
        "active_area_um2", "coarse_mm", "to_nm", "vein_pitch_mm", "rim_mm", r"films\.side_mm", r"print\.diameter_mm",
        r"print\.radius_mm", r"pins\.tip_mm", "edge_radius_mm", r"scales\[0\]\.width_mm", "soft_angle_deg", "threshold_spread", "valley_mm",
        "emboss_width_mm", "window_apart_mm", "window_from_mouth_mm")),
    # the device as a whole
    r"gel: the (slab|dome|fingertip)", r"gel\.frame: clear is for coated gels", r"beads: a grid", r"beads.depth_mm: \S+ puts beads",
    r"pins(\.\w+)?: (\S+ (rings|is longer|lets)|stand on|the (coating|gel)|a first ring)",
    r"is not in front of the plate", r"is the lamp's own position", r"is longer than a frame",
    r"the camera has no direction", r"mm from the camera; allowed is at most",
    r"camera.auto_white_balance: the camera is grey", r"a curve of \d+ points; at least 2", r"point \d+ of a curve is at",
    r"vignetting's points go from",
    r"camera.motion_chip: a picture of", r"event pixels are single ones",
    r"is sharp beyond that only", r"it must be at least the focal length",
    # how many there are, or which
    r"has \d+ numbers; allowed are 1 to", r"has \d+ numbers, 2 are needed", r"distortion: \d+ numbers",
    r"\d+ wavelengths; allowed are", r"edge_side: \S+ is not allowed; allowed is one of", r"there is none; allowed is one",
    r"has no (scene|object); at least one", r"stands here a second time", r"one stands here a second",
    r"is empty; (at least one|allowed are)", r"has the name '.*' a second time", r"stands there a second time",
    # texts
    r"isn't a name", r"can't name (a folder|files)", r"relief.text: there's no letter", r"an sRGB colour is #",
    # one value against another
    r"leads that axis to a force", r"the numbers must rise", r"can't be shifted by", r"the first must not be the larger", r"draws go from",
    r"leave nothing of cells", r"there's no grit", r"each level needs one", r"add up to", r"samples, \d+ a file; allowed are", r"each unit needs one", r"that differ in nothing",
    # studies of designs
    r"a number that is to be changed must stand there", r"is varied twice", r"(values|vary): is empty", r"values: \S+ after \S+, they must rise",
    r"'plate' is missing, through which", r"'from' is missing", r"needs two depths or more", r"it must be at least load_N",
]

KIND_OF_FOLDER = {"devices": "device", "objects": "object", "motions": "motion", "jobs": "job", "studies": "study",
                  "palpation": "palpation", "fits": "fit", "residuals": "residual", "chroma": "scene", "gelsight": "scene", "vhs": "scene"}


def plain(node):
    """A YAML node by the core schema of YAML 1.2, as editors read it (PyYAML's own is 1.1: there `on` is true)."""
    if isinstance(node, yaml.MappingNode):
        return {plain(key): plain(value) for key, value in node.value}
    if isinstance(node, yaml.SequenceNode):
        return [plain(item) for item in node.value]
    text = node.value
    if node.style is not None:
        return text
    if text in ("", "~", "null", "Null", "NULL"):
        return None
    if text.lower() in ("true", "false") and text in (text.lower(), text.upper(), text.capitalize()):
        return text.lower() == "true"
    if re.fullmatch(r"[-+]?[0-9]+", text):
        return int(text)
    if re.fullmatch(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?", text):
        return float(text)
    return text


class Reader:
    """The program's own reader, in one process."""

    def __init__(self, program):
        self.process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def error(self, kind, path):
        """What is wrong with a file, or None."""
        self.process.stdin.write(f"{kind} {path}\n")
        self.process.stdin.flush()
        answer = self.process.stdout.readline().strip()
        if not answer:
            sys.exit(f"the reader died of {path}:\n{pathlib.Path(path).read_text()}")
        return None if answer == "taken" else answer


def at(data, path):
    for step in path:
        data = data[step]
    return data


def applying(schema, value):
    """The parts of a schema that speak about a value, without combinations."""
    if not isinstance(schema, dict):
        return []
    parts = [schema]
    for part in schema.get("allOf", []):
        parts += applying(part, value)
    for part in schema.get("anyOf", []):
        if jsonschema.Draft7Validator(part).is_valid(value):
            parts += applying(part, value)
    if "if" in schema:
        held = jsonschema.Draft7Validator(schema["if"]).is_valid(value)
        parts += applying(schema.get("then" if held else "else"), value)
    return parts


def within(schemas, value, step):
    """The schemas of what stands at one step within a value."""
    found = []
    for schema in schemas:
        if isinstance(value, dict):
            inner = schema.get("properties", {}).get(step)
        else:
            inner = schema.get("items")
        if isinstance(inner, dict):
            found += applying(inner, value[step])
    return found


def sample(schema):
    """Something that a schema takes."""
    if "anyOf" in schema:
        return sample(schema["anyOf"][-1])
    if "enum" in schema:
        return schema["enum"][0]
    kind = schema.get("type")
    if isinstance(kind, list):
        return "text"
    if kind in ("number", "integer"):
        low = schema.get("minimum", schema.get("exclusiveMinimum"))
        high = schema.get("maximum", schema.get("exclusiveMaximum"))
        if low is not None and high is not None:
            middle = 0.5 * (low + high)
            return int(middle + 0.5) if kind == "integer" else middle
        return low + 1 if low is not None else high - 1 if high is not None else 1
    if kind == "boolean":
        return True
    if kind == "string":
        return schema["pattern"].strip("^$").replace("\\", "").replace(".*", "") + "112233"
    if kind == "array":
        return [sample(schema["items"]) for _ in range(schema.get("minItems", 1))]
    made = {}
    for _ in range(4):  # what is required may require more
        for part in applying(schema, made):
            if "oneOf" in part and not any(key in made for one in part["oneOf"] for key in one["required"]):
                part = {"required": part["oneOf"][0]["required"]}
            for key in part.get("required", []):
                if key not in made and isinstance(schema["properties"].get(key), dict):
                    made[key] = sample(schema["properties"][key])
    return made


def all_properties(schemas):
    found = {}
    for schema in schemas:
        for key, inner in schema.get("properties", {}).items():
            if isinstance(inner, dict):
                found.setdefault(key, inner)
        for part in schema.get("allOf", []):
            for branch in ("then", "else"):
                for key, inner in all_properties([part[branch]] if branch in part else []).items():
                    found.setdefault(key, inner)
    return found


def spoilt(data, schemas, path=()):
    """(path, what was done, the value in its place or a function of the parent) for each way to spoil a file.
    A name that begins with `!` is one that both must refuse."""
    value = at(data, path)
    if isinstance(value, dict):
        yield path, "!unknown key", {**value, "unknown_key": 1}
        for key in value:
            yield path, f"{key} removed", {k: v for k, v in value.items() if k != key}
        for key, schema in all_properties(schemas).items():
            if key not in value:
                yield path, f"{key} added", {**value, key: sample(schema)}
        yield path, "map for number", 5
        yield path, "!map for list", [value]
        for key in value:
            yield from spoilt(data, within(schemas, value, key), path + (key,))
    elif isinstance(value, list):
        yield path, "list for number", 5
        yield path, "!list for map", {"unknown_key": 5}
        yield path, "list emptied", []
        yield path, "list longer", value + value[-1:]
        seen = set()
        for k, item in enumerate(value):
            shape = json.dumps(item) if not isinstance(item, dict) else json.dumps({**item, **{
                key: 0 for key, v in item.items() if not isinstance(v, (str, dict))}}, sort_keys=True)
            if shape not in seen and len(seen) < 20:
                yield from spoilt(data, within(schemas, value, k), path + (k,))
            seen.add(shape)
    else:
        yield path, "!nothing", None
        yield path, "!map", {"unknown_key": 1}
        yield path, "list", [value, [value]]
        names = [name for schema in schemas for name in schema.get("enum", [])]
        if names:
            yield path, "!unknown name", "no such name"
        for name in names:
            yield path, f"name {name}", name
        if isinstance(value, bool):
            yield path, "!text for boolean", "maybe"
            yield path, "!number for boolean", 1
            yield path, "other", not value
        elif isinstance(value, (int, float)):
            if not any("enum" in schema or isinstance(schema.get("type"), list) for schema in schemas):
                yield path, "!text for number", "many"
            yield path, "fraction", value + 0.25
            for other in (0, 1, -1, 10**9, -10**9):
                yield path, f"{other}", other
            numbers = [schema for schema in schemas if schema.get("type") in ("number", "integer")]
            for schema in numbers:
                for bound, step in (("minimum", -1), ("maximum", 1), ("exclusiveMinimum", 0), ("exclusiveMaximum", 0)):
                    if bound in schema:
                        beyond = schema[bound] + step * max(1, abs(schema[bound]) * 1e-6)
                        beyond = int(beyond) if schema["type"] == "integer" else beyond
                        # A place may belong to several cases with bounds of their own.
                        sure = not any(jsonschema.Draft7Validator(other).is_valid(beyond) for other in numbers)
                        yield path, f"{'!' if sure else ''}beyond {bound}", beyond
        else:
            if value.startswith("#"):
                yield path, "half a colour", value[:4]
            yield path, "number for text", 5
            yield path, "other text", "no such text"


def changed(data, path, value):
    if not path:
        return value
    data = copy.deepcopy(data)
    at(data, path[:-1])[path[-1]] = value
    return data


def context(data, path):
    """What the fields at a place may depend on: the texts beside it and above it."""
    beside = []
    for depth in range(len(path) + 1):
        above = at(data, path[:depth])
        if isinstance(above, dict):
            beside.append(tuple((k, v) for k, v in above.items() if k in ("type", "shape", "kind", "weave", "embossing",
                                                                        "pattern", "preset", "field", "bayer")
                              and isinstance(v, str)))
            beside.append(tuple(sorted(above)) if depth == len(path) else ())
    return tuple(beside)


def keys_in_sources(source):
    """Keys that `fields` functions read by their plain names."""
    found = set()
    for folder in ("sim", "datasets", "lab"):
        for file in sorted((source / folder).rglob("*.cpp")):
            found |= set(re.findall(r'(?:in\.(?:required|optional|required_name)|needed)\(\s*(?:[^";]*?)"(\w+)"',
                                    file.read_text()))
    return found


def keys_in_schema(schema):
    found = set()
    if isinstance(schema, dict):
        found |= set(schema.get("properties", {}))
        for inner in schema.values():
            found |= keys_in_schema(inner)
    elif isinstance(schema, list):
        for inner in schema:
            found |= keys_in_schema(inner)
    return found


def main(touchstone, read_yaml_files, source):
    wrong = []
    source = pathlib.Path(source)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        scenes = folder / "scenes"
        shutil.copytree(source / "scenes", scenes)
        subprocess.run([touchstone, "schema", "-o", folder / "schemas"], check=True, stdout=subprocess.DEVNULL)
        schemas = {}
        for file in sorted((folder / "schemas").iterdir()):
            kind = file.name.removesuffix(".schema.json")
            schemas[kind] = json.loads(file.read_text())
            jsonschema.Draft7Validator.check_schema(schemas[kind])
            again = subprocess.run([touchstone, "schema", kind], check=True, stdout=subprocess.PIPE, text=True).stdout
            if again != file.read_text():
                wrong.append(f"{kind}: two runs give different bytes")
        if set(schemas) != set(KIND_OF_FOLDER.values()):
            wrong.append(f"kinds are {sorted(schemas)}")
        read = keys_in_sources(source)
        missing = read - set().union(*(keys_in_schema(schema) for schema in schemas.values()))
        if len(read) < 250 or missing:
            wrong.append(f"of {len(read)} keys that the sources read no schema has {sorted(missing)}")

        reader = Reader(read_yaml_files)
        counts = collections.Counter()
        met = collections.Counter()
        seen = set()
        for file in sorted(scenes.rglob("*.yaml")):
            data = plain(yaml.compose(file.read_text()))
            # A study may keep a device beside it.
            kind = "device" if "gel" in data else KIND_OF_FOLDER[file.relative_to(scenes).parts[0]]
            validator = jsonschema.Draft7Validator(schemas[kind])
            for error in validator.iter_errors(data):
                wrong.append(f"{file.relative_to(folder)}: refused by its schema: {error.message} at {list(error.path)}")
            if refusal := reader.error(kind, file):
                wrong.append(refusal)
            counts[kind] += 1
            # As JSON, which is YAML, too: names and texts in quotes, numbers plain.
            spoilt_file = file.with_name("spoilt.yaml")
            for path, how, value in spoilt(data, applying(schemas[kind], data)):
                place = (kind, tuple("*" if isinstance(step, int) else step for step in path), how, context(data, path))
                if place in seen:
                    continue
                seen.add(place)
                bad = changed(data, path, value)
                spoilt_file.write_text(json.dumps(bad, ensure_ascii=False))
                fault = next(validator.iter_errors(bad), None)
                refusal = reader.error(kind, spoilt_file)
                counts["spoilt"] += 1
                what = f"{file.relative_to(folder)} at {'.'.join(map(str, path))}, {how} ({json.dumps(value)[:80]})"
                if fault and not refusal:
                    wrong.append(f"{what}: the schema alone refuses it: {fault.message[:200]}")
                elif how.startswith("!") and not (fault and refusal):
                    wrong.append(f"{what}: taken by {'the schema' if refusal else 'both'}; {refusal}")
                elif refusal and not fault:
                    known = [pattern for pattern in ONLY_READERS if re.search(pattern, refusal)]
                    met.update(known)
                    if not known:
                        wrong.append(f"{what}: the reader alone refuses it: {refusal}")
                counts["refused by both" if fault and refusal else "taken" if not refusal else "only by the reader"] += 1
            spoilt_file.unlink(missing_ok=True)
        for pattern in ONLY_READERS:
            if not met[pattern]:
                wrong.append(f"ONLY_READERS has '{pattern}', which nothing met")
    print(dict(counts))
    for line in wrong[:200]:
        print(line)
    if counts["spoilt"] < 2000:
        wrong.append("too few")
    sys.exit(f"{len(wrong)} wrong" if wrong else 0)


main(*sys.argv[1:])
