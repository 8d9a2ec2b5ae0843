"""The symbolic model of scan matching: one point against the smooth probability grid, derivatives by CasADi.

Nothing here runs during mapping: `tools/generate_kernels.py` writes the functions below as numba
kernels into `_generated.py`.
"""

import casadi as ca


def spline_weights(t: ca.SX) -> ca.SX:
    """Weights of the four neighbours of the uniform cubic B-spline at t in [0, 1), shape (4, 1).

    The B-spline approximates the cells rather than passing through them: it is a bicubic surface
    with continuous second derivatives that smooths by about half a cell, which widens the basin of
    the match and averages the quantisation of ranges.
    """
    s, sixth = 1.0 - t, 1.0 / 6.0
    left, right = (0.5 * t - 1.0) * t * t + 2.0 / 3.0, (0.5 * s - 1.0) * s * s + 2.0 / 3.0
    return ca.vertcat(sixth * s * s * s, left, right, sixth * t * t * t)


def occupied_space_function() -> ca.Function:
    """Residual 1 - M_smooth(T h) of one point h and its gradient by the pose T (METHODS.md, section 0).

    `c[4 j + i]` is the probability of the cell in column `column + i - 1` and row `row + j - 1`.
    """
    pose, point, origin = ca.SX.sym("pose", 3), ca.SX.sym("point", 2), ca.SX.sym("origin", 2)
    inverse_resolution, column, row = ca.SX.sym("inverse_resolution"), ca.SX.sym("column"), ca.SX.sym("row")
    cells = ca.SX.sym("c", 16)
    cosine, sine = ca.cos(pose[2]), ca.sin(pose[2])
    x = cosine * point[0] - sine * point[1] + pose[0]
    y = sine * point[0] + cosine * point[1] + pose[1]
    u = (x - origin[0]) * inverse_resolution - 0.5 - column
    v = (y - origin[1]) * inverse_resolution - 0.5 - row
    along_x = ca.reshape(cells, 4, 4).T @ spline_weights(u)
    residual = 1.0 - ca.dot(along_x, spline_weights(v))
    return ca.Function(
        "occupied_space",
        [pose, point, origin, inverse_resolution, column, row, cells],
        [residual, ca.jacobian(residual, pose)],
        ["pose", "point", "origin", "inverse_resolution", "column", "row", "c"],
        ["residual", "gradient"],
    )


def functions() -> dict[str, ca.Function]:
    """Name of the kernel -> function."""
    return {"occupied_space": occupied_space_function()}
