"""Kernels translated from CasADi compute what CasADi computes, and the committed ones are up to date."""

import importlib
import math

import casadi as ca
import generate_kernels as tool
import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.symbolic import render_module, translate
from glassslam.symbolic.operations import TEMPLATES, literal


def interpreted(source: str, name: str, kernel=lambda function: function):
    """The translated function in plain Python."""
    names = {"math": math, "np": np, "kernel": kernel}
    exec(source, names)  # noqa: S102
    return names[name]


def compiled(source: str, name: str):
    """The translated function compiled, as the project compiles but for the cache."""
    return interpreted(source, name, numba.njit(error_model="numpy"))


def flat(function: ca.Function, values: np.ndarray) -> np.ndarray:
    """All entries of all outputs for the entries of all inputs, by CasADi itself."""
    inputs, start = [], 0
    for i in range(function.n_in()):
        rows, columns = function.size_in(i)
        inputs.append(ca.reshape(ca.DM(values[start : start + rows * columns].tolist()), rows, columns))
        start += rows * columns
    return np.concatenate([np.asarray(out.full()).ravel(order="F") for out in function.call(inputs)])


def two_sided() -> ca.Function:
    """A vector, a matrix and a scalar in; sparse outputs, a constant and shared terms out."""
    x, m, k = ca.SX.sym("x", 2), ca.SX.sym("m", 2, 2), ca.SX.sym("k")
    r = ca.vertcat(ca.sin(x[0]) * k, (m @ x)[1] + ca.sin(x[0]) * k, -3.5)
    return ca.Function("two_sided", [x, m, k], [r, ca.jacobian(r, x)], ["x", "m", "k"], ["r", "j"])


def test_every_entry_is_an_argument_and_every_output_a_number():
    source = translate(two_sided())
    assert (
        "def two_sided(x_0: float, x_1: float, m_0: float, m_1: float, m_2: float, m_3: float, k: float)"
        in source
    )
    assert source.count("math.sin") == 1, "shared terms are computed once"
    values = np.array([0.3, -1.2, 2.0, 0.5, -0.7, 1.1, 0.9])
    result = interpreted(source, "two_sided")(*values)
    assert len(result) == 9
    np.testing.assert_allclose(result, flat(two_sided(), values), rtol=1e-15, atol=0)
    assert result[5] == result[6] == result[8] == 0.0, "structural zeros are zeros"


def test_a_compiled_kernel_computes_the_same():
    fast = compiled(translate(two_sided(), "renamed"), "renamed")
    values = np.array([0.3, -1.2, 2.0, 0.5, -0.7, 1.1, 0.9])
    np.testing.assert_allclose(fast(*values), flat(two_sided(), values), rtol=1e-15, atol=0)


UNARY = [
    "sin", "cos", "tan", "atan", "sinh", "cosh", "tanh", "asinh", "exp", "floor", "ceil", "fabs", "sign",
    "erf", "sqrt", "log", "asin", "acos", "acosh", "atanh", "log1p", "expm1",
]  # fmt: skip
BINARY = ["plus", "minus", "times", "rdivide", "power", "fmin", "fmax", "atan2", "fmod", "copysign", "hypot"]
DOMAIN = {"sqrt": (0.1, 4), "log": (0.1, 4), "asin": (-0.9, 0.9), "acos": (-0.9, 0.9), "acosh": (1.1, 4),
          "atanh": (-0.9, 0.9), "log1p": (-0.5, 3), "power": (0.1, 3),
          "fmod": (0.2, 3), "rdivide": (0.2, 3)}  # fmt: skip


def all_operations() -> tuple[ca.Function, list[tuple[float, float]]]:
    """One function that uses every elementary operation, each on inputs of its own."""
    inputs, outputs, domains = [], [], []
    for name in UNARY + BINARY:
        operands = [ca.SX.sym(f"{name}_{i}") for i in range(1 if name in UNARY else 2)]
        inputs += operands
        domains += [DOMAIN.get(name, (-3.0, 3.0))] * len(operands)
        outputs.append(getattr(ca, name)(*operands))
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    inputs, domains = [*inputs, a, b], [*domains, (-3.0, 3.0), (0.5, 3.0)]
    outputs += [-a, 1 / b, a * a, a + a, a**3, b**2.5, a < b, a <= b, a == b, a != b]
    outputs += [ca.logic_not(a), ca.logic_and(a, b), ca.logic_or(a, b), ca.if_else(a < 0, b, a), ca.SX(2.5)]
    names = [f"in{i}" for i in range(len(inputs))]
    return ca.Function(
        "operations", inputs, outputs, names, [f"out{i}" for i in range(len(outputs))]
    ), domains


OPERATIONS, DOMAINS = all_operations()
OPERATIONS_KERNEL = interpreted(translate(OPERATIONS), "operations")


@given(st.lists(st.floats(0, 1), min_size=len(DOMAINS), max_size=len(DOMAINS)))
def test_every_operation_means_what_casadi_means(fractions):
    values = np.array([low + f * (high - low) for f, (low, high) in zip(fractions, DOMAINS, strict=True)])
    expected = flat(OPERATIONS, values)
    np.testing.assert_allclose(OPERATIONS_KERNEL(*values), expected, rtol=1e-13, atol=1e-15)


def test_every_operation_compiles():
    fast = compiled(translate(OPERATIONS), "operations")
    values = np.array([low + 0.3 * (high - low) for low, high in DOMAINS])
    np.testing.assert_allclose(fast(*values), flat(OPERATIONS, values), rtol=1e-13, atol=1e-15)


def test_rounding_stays_a_float_beyond_the_range_of_integers():
    x = ca.SX.sym("x")
    source = translate(ca.Function("down", [x], [ca.floor(x)], ["x"], ["y"]))
    assert compiled(source, "down")(1e300) == (1e300,)


def test_every_known_operation_is_tried_above():
    tried = {OPERATIONS.instruction_id(k) for k in range(OPERATIONS.n_instructions())}
    assert set(TEMPLATES) - tried <= {ca.OP_ASSIGN, ca.OP_CONSTPOW, ca.OP_POW}


@given(st.floats())
def test_a_literal_reads_back_to_the_same_bits(value):
    read = eval(literal(value), {"math": math})  # noqa: S307
    assert math.isnan(read) if math.isnan(value) else (read == value)
    assert math.copysign(1, read) == math.copysign(1, value) or math.isnan(value)


def test_a_function_of_matrices_is_refused():
    x = ca.MX.sym("x")
    with pytest.raises(ValueError, match=r"^'f' is no function of SX expressions: expand it first$"):
        translate(ca.Function("f", [x], [x]))


@pytest.mark.parametrize("name", ["math", "np", "kernel", "lambda", "float"])
def test_a_name_the_kernel_needs_itself_is_refused(name):
    x = ca.SX.sym("x")
    with pytest.raises(ValueError, match=f"'{name}' is no name for a kernel or an argument"):
        translate(ca.Function("f", [x], [x]), name)


def test_an_operation_without_counterpart_is_named():
    x = ca.SX.sym("x")
    with pytest.raises(ValueError, match=r"^operation OP_ERFINV has no counterpart in numba$"):
        translate(ca.Function("f", [x], [ca.erfinv(x)]))


def test_a_module_holds_its_kernels_and_the_version_that_made_them():
    source = render_module({"first": two_sided(), "second": two_sided()}, "Two kernels")
    assert source.startswith('"""Two kernels: written by tools/generate_kernels.py, do not edit."""')
    assert f"CASADI_VERSION = {ca.CasadiMeta.version()!r}" in source
    assert source.count("@kernel") == 2


MODELS = sorted(tool.available())


@pytest.mark.parametrize("module", MODELS)
def test_the_committed_kernels_are_what_the_model_gives_today(module):
    text = tool.generated_path(module).read_text(encoding="utf-8")
    generated = importlib.import_module(module.replace(".model", "._generated"))
    if ca.CasadiMeta.version() != generated.CASADI_VERSION:
        pytest.skip(f"written with CasADi {generated.CASADI_VERSION}")
    assert text == tool.source(module)


@pytest.mark.parametrize("module", MODELS)
def test_the_committed_kernels_compute_what_the_model_computes(module):
    functions = importlib.import_module(module).functions()
    generated = importlib.import_module(module.replace(".model", "._generated"))
    rng = np.random.default_rng(5)
    for name, function in functions.items():
        size = sum(function.numel_in(i) for i in range(function.n_in()))
        for values in rng.uniform(0.1, 2.0, (20, size)):
            result = getattr(generated, name)(*values)
            np.testing.assert_allclose(result, flat(function, values), rtol=1e-11, atol=1e-11)


def test_the_tool_reports_a_stale_file(monkeypatch, tmp_path, capsys):
    model = "glassslam.posegraph.model"
    stale = tmp_path / "_generated.py"
    monkeypatch.setattr(tool, "ROOT", tmp_path)
    monkeypatch.setattr(tool, "available", lambda: {model: ""})
    monkeypatch.setattr(tool, "generated_path", lambda module: stale)
    assert tool.main(["--check"]) == 1
    assert capsys.readouterr().out == "_generated.py is out of date: run tools/generate_kernels.py\n"
    assert not stale.exists()
    assert tool.main([]) == 0
    assert tool.main(["--check"]) == 0
