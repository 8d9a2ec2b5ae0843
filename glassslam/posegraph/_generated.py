"""Residuals of the pose graph and their derivatives: written by tools/generate_kernels.py, do not edit."""

# ruff: noqa
# fmt: off

import math

import numpy as np

from glassslam.accelerate import kernel

CASADI_VERSION = '3.8.2'


@kernel
def between(a_0: float, a_1: float, a_2: float, b_0: float, b_1: float, b_2: float, z_0: float, z_1: float, z_2: float, w_0: float, w_1: float, w_2: float, w_3: float, w_4: float, w_5: float, w_6: float, w_7: float, w_8: float) -> tuple[float, float, float, float, float, float, float, float, float, float, float, float, float, float, float, float, float, float, float, float, float]:
    """(a, b, z, w) -> r[3], ja[9], jb[9]."""
    _0 = math.cos(a_2)
    _1 = b_0 - a_0
    _2 = _0 * _1
    _3 = math.sin(a_2)
    _4 = b_1 - a_1
    _5 = _3 * _4
    _6 = _2 + _5
    _7 = z_0 - _6
    _8 = w_0 * _7
    _9 = _0 * _4
    _10 = _3 * _1
    _11 = _9 - _10
    _12 = z_1 - _11
    _13 = w_3 * _12
    _14 = _8 + _13
    _15 = b_2 - a_2
    _16 = z_2 - _15
    _17 = _16 + 3.141592653589793
    _18 = _17 / 6.283185307179586
    _19 = np.floor(_18)
    _20 = 6.283185307179586 * _19
    _21 = _16 - _20
    _22 = w_6 * _21
    _23 = _14 + _22
    _24 = w_1 * _7
    _25 = w_4 * _12
    _26 = _24 + _25
    _27 = w_7 * _21
    _28 = _26 + _27
    _29 = w_2 * _7
    _30 = w_5 * _12
    _31 = _29 + _30
    _32 = w_8 * _21
    _33 = _31 + _32
    _34 = w_0 * _0
    _35 = w_3 * _3
    _36 = _34 - _35
    _37 = w_1 * _0
    _38 = w_4 * _3
    _39 = _37 - _38
    _40 = w_2 * _0
    _41 = w_5 * _3
    _42 = _40 - _41
    _43 = w_0 * _3
    _44 = w_3 * _0
    _45 = _43 + _44
    _46 = w_1 * _3
    _47 = w_4 * _0
    _48 = _46 + _47
    _49 = w_2 * _3
    _50 = w_5 * _0
    _51 = _49 + _50
    _52 = _4 * _3
    _53 = _1 * _0
    _54 = _52 + _53
    _55 = w_3 * _54
    _56 = _4 * _0
    _57 = _1 * _3
    _58 = _56 - _57
    _59 = w_0 * _58
    _60 = _55 - _59
    _61 = _60 + w_6
    _62 = w_4 * _54
    _63 = w_1 * _58
    _64 = _62 - _63
    _65 = _64 + w_7
    _66 = w_5 * _54
    _67 = w_2 * _58
    _68 = _66 - _67
    _69 = _68 + w_8
    _70 = _35 - _34
    _71 = _38 - _37
    _72 = _41 - _40
    _73 = -_45
    _74 = -_48
    _75 = -_51
    _76 = -w_6
    _77 = -w_7
    _78 = -w_8
    return (_23, _28, _33, _36, _39, _42, _45, _48, _51, _61, _65, _69, _70, _71, _72, _73, _74, _75, _76, _77, _78)


@kernel
def huber(s: float, k: float) -> tuple[float, float]:
    """(s, k) -> rho[1], weight[1]."""
    _0 = k * k
    _1 = 1.0 if s <= _0 else 0.0
    _2 = s if _1 != 0.0 else 0.0
    _3 = 1.0 if _1 == 0.0 else 0.0
    _4 = 2.0 * k
    _5 = _0 if _0 > s else s
    _6 = math.sqrt(_5)
    _7 = _4 * _6
    _8 = _7 - _0
    _9 = _8 if _3 != 0.0 else 0.0
    _10 = _2 + _9
    _11 = 1.0 if _0 <= s else 0.0
    _12 = _11 + _1
    _13 = _11 / _12
    _14 = k / _6
    _15 = _13 * _14
    _16 = _15 if _3 != 0.0 else 0.0
    _17 = 1.0 if _1 != 0.0 else 0.0
    _18 = _16 + _17
    return (_10, _18)


@kernel
def geman_mcclure(s: float, k: float) -> tuple[float, float]:
    """(s, k) -> rho[1], weight[1]."""
    _0 = s * k
    _1 = _0 * k
    _2 = k * k
    _3 = s + _2
    _4 = _1 / _3
    _5 = k / _3
    _6 = k * _5
    _7 = _4 / _3
    _8 = _6 - _7
    return (_4, _8)
