"""Translation of CasADi SX functions into source that numba compiles and inlines."""

import keyword
from collections.abc import Mapping

import casadi as ca

from glassslam.symbolic.operations import TEMPLATES, literal

_TAKEN = frozenset({"math", "np", "kernel", "abs", "float"})


def translate(function: ca.Function, name: str | None = None) -> str:
    """Source of a kernel that computes what a CasADi SX function computes.

    The kernel takes every entry of every input as a scalar (column-major; input `p` of one entry is
    called `p`, of several `p_0, p_1, ...`) and returns one flat tuple with every entry of every
    output, in order, zeros included. Scalars in and a tuple out stay in registers once numba has
    inlined the call: a bicubic point residual with its three derivatives takes 44 ns this way,
    48 ns when its 16 cells come in an array, 74 ns when the result goes into one.

    Parameters
    ----------
    function : casadi.Function
        Built from SX expressions, without calls to other functions that were not expanded.
    name : str, optional
        Name of the kernel; the name of the function when not given.

    Returns
    -------
    str
        A decorated function definition. It needs `math`, `numpy as np` and `kernel` in its module.

    Raises
    ------
    ValueError
        The function is no SX function, uses an operation numba has no counterpart for, or a name
        is no Python identifier.

    Examples
    --------
    >>> x = ca.SX.sym("x")
    >>> print(translate(ca.Function("square", [x], [x * x], ["x"], ["y"])))
    @kernel
    def square(x: float) -> tuple[float]:
        \"\"\"(x) -> y[1].\"\"\"
        _0 = x * x
        return (_0,)
    <BLANKLINE>
    """
    name = name or function.name()
    dense = _dense(function)
    arguments = [_argument_names(dense, i) for i in range(dense.n_in())]
    lines, results = _body(dense, arguments)
    flat = [argument for group in arguments for argument in group]
    for identifier in (name, *flat):
        if not identifier.isidentifier() or keyword.iskeyword(identifier) or identifier in _TAKEN:
            raise ValueError(f"{identifier!r} is no name for a kernel or an argument")
    signature = ", ".join(f"{argument}: float" for argument in flat)
    returned = ", ".join(results)
    return "\n".join(
        (
            "@kernel",
            f"def {name}({signature}) -> tuple[{', '.join(['float'] * len(results))}]:",
            f'    """{_summary(dense)}."""',
            *(f"    {line}" for line in lines),
            f"    return ({returned}{',' if len(results) == 1 else ''})",
            "",
        )
    )


def render_module(functions: Mapping[str, ca.Function], title: str) -> str:
    """Source of a whole module of kernels.

    Parameters
    ----------
    functions : mapping
        Name of the kernel -> casadi.Function of SX expressions.
    title : str
        What the kernels are, one line without a full stop.
    """
    header = (
        f'"""{title}: written by tools/generate_kernels.py, do not edit."""\n\n'
        "# ruff: noqa\n# fmt: off\n\n"
        "import math\n\nimport numpy as np\n\nfrom glassslam.accelerate import kernel\n"
        f"\nCASADI_VERSION = {ca.CasadiMeta.version()!r}\n"
    )
    return "\n\n".join((header, *(translate(function, name) for name, function in functions.items())))


def _dense(function: ca.Function) -> ca.Function:
    """The same function with dense outputs and common subexpressions computed once."""
    if not function.is_a("SXFunction"):
        raise ValueError(f"{function.name()!r} is no function of SX expressions: expand it first")
    inputs = [
        ca.SX.sym(function.name_in(i), ca.Sparsity.dense(*function.size_in(i)))
        for i in range(function.n_in())
    ]
    outputs = ca.cse([ca.densify(output) for output in function.call(inputs)])
    return ca.Function(function.name(), inputs, outputs, function.name_in(), function.name_out())


def _argument_names(function: ca.Function, index: int) -> list[str]:
    name, size = function.name_in(index), function.numel_in(index)
    return [name] if size == 1 else [f"{name}_{k}" for k in range(size)]


def _summary(function: ca.Function) -> str:
    inputs = ", ".join(function.name_in())
    outputs = ", ".join(f"{function.name_out(i)}[{function.numel_out(i)}]" for i in range(function.n_out()))
    return f"({inputs}) -> {outputs}"


def _body(function: ca.Function, arguments: list[list[str]]) -> tuple[list[str], list[str]]:
    """Statements and the flat list of names or literals that are returned."""
    register: dict[int, str] = {}
    offsets = [sum(function.numel_out(i) for i in range(k)) for k in range(function.n_out())]
    results = ["0.0"] * sum(function.numel_out(i) for i in range(function.n_out()))
    lines: list[str] = []
    for k in range(function.n_instructions()):
        operation, source = function.instruction_id(k), function.instruction_input(k)
        target = function.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            results[offsets[target[0]] + target[1]] = register[source[0]]
        elif operation == ca.OP_INPUT:
            register[target[0]] = arguments[source[0]][source[1]]
        elif operation == ca.OP_CONST:
            register[target[0]] = literal(function.instruction_constant(k))
        else:
            operands = [register[i] for i in source]
            # a fresh name per value: CasADi reuses its registers, which would hide what is what
            register[target[0]] = f"_{len(lines)}"
            lines.append(f"_{len(lines)} = {_expression(operation, operands)}")
    return lines, results


def _expression(operation: int, operands: list[str]) -> str:
    template = TEMPLATES.get(operation)
    if template is None:
        names = [name for name in dir(ca) if name.startswith("OP_") and getattr(ca, name) == operation]
        raise ValueError(f"operation {names[0] if names else operation} has no counterpart in numba")
    return template.format(*operands)
