"""What the stubs promise is what the module has, and all of it is described."""

import ast
import inspect
import pathlib

import touchstone as ts
from touchstone import _core


def stub():
    path = pathlib.Path(ts.__file__).with_name("_core.pyi")
    return ast.parse(path.read_text())


def public(names):
    return {name for name in names if not name.startswith("_")}


def test_the_stub_names_what_the_module_has():
    stubbed = {node.name: node for node in stub().body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    assert public(dir(_core)) == public(stubbed)
    for name, node in stubbed.items():
        if isinstance(node, ast.ClassDef):
            members = {one.name for one in node.body if isinstance(one, ast.FunctionDef)}
            assert public(vars(getattr(_core, name))) == public(members), name


def test_the_stub_names_the_arguments_of_the_module():
    def check(where, node, function):
        if function.__doc__ is None or "(" not in function.__doc__:
            return 0
        signature = function.__doc__.splitlines()[0]  # pybind11 writes it
        arguments = node.args
        for one in arguments.posonlyargs + arguments.args + arguments.kwonlyargs:
            assert f"{one.arg}: " in signature, f"{where}: {one.arg} isn't in {signature}"
        wanted = len(arguments.posonlyargs + arguments.args + arguments.kwonlyargs)
        depth, count = 0, 0
        inside = signature[signature.index("(") + 1:signature.rindex(") ->")]
        for i, letter in enumerate(inside):
            depth += letter in "([{"
            depth -= letter in ")]}"
            # a default may be any text; arguments are "name: type" at depth 0
            count += letter == ":" and depth == 0 and inside[i + 1:i + 2] == " "
        assert count == wanted, f"{where}: {signature}"
        return 1

    checked = 0
    for node in stub().body:
        if isinstance(node, ast.FunctionDef):
            checked += check(node.name, node, getattr(_core, node.name))
        elif isinstance(node, ast.ClassDef):
            for one in node.body:
                member = vars(getattr(_core, node.name)).get(getattr(one, "name", None))
                if isinstance(one, ast.FunctionDef) and not isinstance(member, (property, type(None))):
                    one.args.args = [a for a in one.args.args if a.arg != "self"]
                    member = getattr(_core, node.name).__dict__[one.name]
                    function = getattr(member, "__func__", member)
                    text = (function.__doc__ or "").replace(f"self: touchstone._core.{node.name}, ", "", 1)
                    text = text.replace(f"self: touchstone._core.{node.name}", "", 1)
                    checked += check(f"{node.name}.{one.name}", one, type("f", (), {"__doc__": text}))
    assert checked > 20


def test_everything_public_is_described():
    assert set(ts.__all__) <= set(dir(ts))
    for name in ts.__all__:
        thing = getattr(ts, name)
        assert inspect.getdoc(thing), name
        if inspect.isclass(thing):
            for member in public(vars(thing)):
                assert inspect.getdoc(getattr(thing, member)), f"{name}.{member}"


def test_the_version_is_the_programs():
    text = (pathlib.Path(__file__).parents[2] / "CMakeLists.txt").read_text()
    assert f"VERSION {ts.__version__} " in text
