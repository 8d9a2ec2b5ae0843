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


def surface_derivatives(u: ca.SX, v: ca.SX, cells: ca.SX) -> ca.SX:
    """d^(j+i) M / dv^j du^i in row j and column i, j + i <= 2, of the smooth grid at (u, v), shape (3, 3).

    The surface is a product of a spline along each axis, so two short products give all derivatives.
    """

    def with_derivatives(t: ca.SX) -> ca.SX:
        weights = spline_weights(t)
        slopes = ca.jacobian(weights, t)
        return ca.horzcat(weights, slopes, ca.jacobian(slopes, t))

    return with_derivatives(v).T @ (ca.reshape(cells, 4, 4).T @ with_derivatives(u))


def occupied_space_function() -> ca.Function:
    """Residual 1 - M_smooth(T h) of one point h and its derivatives by the pose T (Hess et al. 2016, IV-C).

    `turned` is R h, the point turned by the heading of the pose; (u, v) is T h from the centre of
    a cell, in cells; `c[4 j + i]` is the probability of the cell i - 1 columns and j - 1 rows
    from that one. The derivatives are those by a small move of the pose: sines of the heading
    are shared by all points of a scan and stay out of the kernel. `hessian` lists the upper
    triangle of the second derivatives, row by row.
    """
    turned, cells, move = ca.SX.sym("turned", 2), ca.SX.sym("c", 16), ca.SX.sym("move", 3)
    u, v, inverse_resolution = ca.SX.sym("u"), ca.SX.sym("v"), ca.SX.sym("inverse_resolution")
    cosine, sine = ca.cos(move[2]), ca.sin(move[2])
    du = inverse_resolution * (cosine * turned[0] - sine * turned[1] + move[0] - turned[0])
    dv = inverse_resolution * (sine * turned[0] + cosine * turned[1] + move[1] - turned[1])
    m = surface_derivatives(u, v, cells)
    # the expansion to second order has the first and second derivatives of the surface itself
    along_u, along_v = m[0, 1] * du + m[0, 2] * du * du / 2, m[1, 0] * dv + m[2, 0] * dv * dv / 2
    residual = 1.0 - (m[0, 0] + along_u + along_v + m[1, 1] * du * dv)
    gradient = ca.jacobian(residual, move)
    hessian = ca.jacobian(gradient, move)
    triangle = ca.vertcat(*(hessian[i, j] for i in range(3) for j in range(i, 3)))
    at_rest = ca.substitute([residual, gradient, triangle], [move], [ca.DM.zeros(3)])
    return ca.Function(
        "occupied_space",
        [turned, u, v, inverse_resolution, cells],
        at_rest,
        ["turned", "u", "v", "inverse_resolution", "c"],
        ["residual", "gradient", "hessian"],
    )


def functions() -> dict[str, ca.Function]:
    """Name of the kernel -> function."""
    return {"occupied_space": occupied_space_function()}
