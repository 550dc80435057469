"""One name for one class, and no modules that import each other."""

import ast

from tools.measure_code import import_circles, modules, shared_class_names


def test_no_two_classes_have_one_name():
    assert shared_class_names(modules()) == []


def test_no_modules_import_each_other():
    assert import_circles(modules()) == []


def test_shared_names_and_circles_are_found():
    first = ast.parse("class Table: ...\nclass Settings: ...\ndef f():\n    import second")
    second = ast.parse("import first\nclass Table: ...\nclass Settings: ...")
    trees = {"first": first, "second": second}
    assert shared_class_names(trees) == ["Table"]
    assert import_circles(trees) == [["first", "second"]]
