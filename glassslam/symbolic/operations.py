"""How each elementary operation of CasADi is written for numba."""

import math

import casadi as ca

TEMPLATES: dict[int, str] = {
    ca.OP_ASSIGN: "{0}",
    ca.OP_ADD: "{0} + {1}",
    ca.OP_SUB: "{0} - {1}",
    ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}",
    ca.OP_NEG: "-{0}",
    ca.OP_INV: "1.0 / {0}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "2.0 * {0}",
    ca.OP_POW: "{0} ** {1}",
    ca.OP_CONSTPOW: "{0} ** {1}",
    ca.OP_SQRT: "math.sqrt({0})",
    ca.OP_HYPOT: "math.hypot({0}, {1})",
    ca.OP_EXP: "math.exp({0})",
    ca.OP_EXPM1: "math.expm1({0})",
    ca.OP_LOG: "math.log({0})",
    ca.OP_LOG1P: "math.log1p({0})",
    ca.OP_ERF: "math.erf({0})",
    ca.OP_SIN: "math.sin({0})",
    ca.OP_COS: "math.cos({0})",
    ca.OP_TAN: "math.tan({0})",
    ca.OP_ASIN: "math.asin({0})",
    ca.OP_ACOS: "math.acos({0})",
    ca.OP_ATAN: "math.atan({0})",
    ca.OP_ATAN2: "math.atan2({0}, {1})",
    ca.OP_SINH: "math.sinh({0})",
    ca.OP_COSH: "math.cosh({0})",
    ca.OP_TANH: "math.tanh({0})",
    ca.OP_ASINH: "math.asinh({0})",
    ca.OP_ACOSH: "math.acosh({0})",
    ca.OP_ATANH: "math.atanh({0})",
    # numpy's rounding stays a float, math's would become an integer and overflow
    ca.OP_FLOOR: "np.floor({0})",
    ca.OP_CEIL: "np.ceil({0})",
    ca.OP_FMOD: "np.fmod({0}, {1})",
    ca.OP_FABS: "abs({0})",
    ca.OP_SIGN: "np.sign({0})",
    ca.OP_COPYSIGN: "math.copysign({0}, {1})",
    # unlike C, a NaN on the left is kept: bad data shall show
    ca.OP_FMIN: "{1} if {1} < {0} else {0}",
    ca.OP_FMAX: "{1} if {1} > {0} else {0}",
    ca.OP_LT: "1.0 if {0} < {1} else 0.0",
    ca.OP_LE: "1.0 if {0} <= {1} else 0.0",
    ca.OP_EQ: "1.0 if {0} == {1} else 0.0",
    ca.OP_NE: "1.0 if {0} != {1} else 0.0",
    ca.OP_NOT: "1.0 if {0} == 0.0 else 0.0",
    ca.OP_AND: "1.0 if {0} != 0.0 and {1} != 0.0 else 0.0",
    ca.OP_OR: "1.0 if {0} != 0.0 or {1} != 0.0 else 0.0",
    ca.OP_IF_ELSE_ZERO: "{1} if {0} != 0.0 else 0.0",
}


def literal(value: float) -> str:
    """A float as source text that reads back to the same bits, in parentheses when negative."""
    if math.isfinite(value):
        text = repr(float(value))
        return f"({text})" if text.startswith("-") else text
    return "math.nan" if math.isnan(value) else ("math.inf" if value > 0 else "(-math.inf)")
