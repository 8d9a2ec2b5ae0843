"""Kernels that enter sonar readings into grids, cell by cell of their cones.

Coordinates are cells: x along columns, y along rows, the centre of cell (row, column) at
(column + 0.5, row + 0.5). A reading is a row (x, y, yaw, free, obstacle, inner): it clears the cone up to
`free` cells, and has an arc of half thickness `inner` around `obstacle` cells, or none when that is negative.
"""

import math

from glassslam.accelerate import kernel
from glassslam.records import FloatArray


@kernel
def belief(
    along: float, across: float, half_width: float, free: float, obstacle: float, thickness: float
) -> float:
    """What a reading says of a point of its cone: above 0 occupied, below 0 empty, 0 nothing.

    The profiles are those of Moravec and Elfes (1985): 1 - (angle / half width)^2 times, for the arc,
    1 - ((d - range) / thickness)^2 and, before it, 1 - (d / free length)^2.
    """
    distance = math.sqrt(along * along + across * across)
    angle = math.atan2(across, along)
    if abs(angle) >= half_width:
        return 0.0
    lobe = 1.0 - (angle / half_width) ** 2
    if obstacle >= 0.0 and abs(distance - obstacle) < thickness:
        return lobe * (1.0 - ((distance - obstacle) / thickness) ** 2)
    if distance < free:
        return -lobe * (1.0 - (distance / free) ** 2)
    return 0.0


@kernel
def box(reading: FloatArray, half_width: float, rows: int, columns: int) -> tuple[int, int, int, int]:
    """First row, last row, first column and last column that the cone of a reading touches."""
    reach = max(reading[3], reading[4] + reading[5])
    low_x = high_x = reading[0]
    low_y = high_y = reading[1]
    # the extremes of a sector lie at its corner rays or where it crosses an axis
    first, last = reading[2] - half_width, reading[2] + half_width
    quarter = 0.5 * math.pi
    angle = first
    following = math.floor(first / quarter) + 1
    while True:
        x, y = reading[0] + reach * math.cos(angle), reading[1] + reach * math.sin(angle)
        low_x, high_x = min(low_x, x), max(high_x, x)
        low_y, high_y = min(low_y, y), max(high_y, y)
        if angle >= last:
            break
        angle = min(following * quarter, last)
        following += 1
    return (
        max(math.floor(low_y), 0),
        min(math.floor(high_y), rows - 1),
        max(math.floor(low_x), 0),
        min(math.floor(high_x), columns - 1),
    )


@kernel
def told(reading: FloatArray, cosine: float, sine: float, row: int, column: int, half_width: float) -> float:
    """What a reading says of a cell, as `belief`; nothing behind the sonar."""
    x, y = column + 0.5 - reading[0], row + 0.5 - reading[1]
    along = cosine * x + sine * y
    if along <= 0.0:
        return 0.0
    return belief(along, cosine * y - sine * x, half_width, reading[3], reading[4], reading[5])


@kernel
def enter_masses(
    readings: FloatArray,
    half_width: float,
    occupied: float,
    empty: float,
    doubt_of_full: FloatArray,
    doubt_of_empty: FloatArray,
) -> None:
    """Add log(1 - mass) of every reading to the Full and the Empty map (Dempster's rule, simple support)."""
    rows, columns = doubt_of_full.shape
    for k in range(readings.shape[0]):
        reading = readings[k]
        cosine, sine = math.cos(reading[2]), math.sin(reading[2])
        r0, r1, c0, c1 = box(reading, half_width, rows, columns)
        for row in range(r0, r1 + 1):
            for column in range(c0, c1 + 1):
                said = told(reading, cosine, sine, row, column, half_width)
                if said > 0.0:
                    doubt_of_full[row, column] += math.log(1.0 - occupied * said)
                elif said < 0.0:
                    doubt_of_empty[row, column] += math.log(1.0 + empty * said)


@kernel
def enter_odds(
    readings: FloatArray,
    half_width: float,
    occupied: float,
    empty: float,
    limit: float,
    odds: FloatArray,
) -> None:
    """Add the log odds of every reading, clamped to +-`limit`; a cell that is NaN begins at even odds."""
    rows, columns = odds.shape
    for k in range(readings.shape[0]):
        reading = readings[k]
        cosine, sine = math.cos(reading[2]), math.sin(reading[2])
        r0, r1, c0, c1 = box(reading, half_width, rows, columns)
        for row in range(r0, r1 + 1):
            for column in range(c0, c1 + 1):
                said = told(reading, cosine, sine, row, column, half_width)
                if said == 0.0:
                    continue
                lean = said * (occupied if said > 0.0 else empty)
                before = 0.0 if math.isnan(odds[row, column]) else odds[row, column]
                odds[row, column] = min(max(before + math.log((1.0 + lean) / (1.0 - lean)), -limit), limit)


@kernel
def enter_means(
    readings: FloatArray,
    half_width: float,
    values: FloatArray,
    old_weight: float,
    new_weight: float,
    cells: FloatArray,
) -> None:
    """Mix the value of every reading into the cells of its arc, and 0 into those before it (ICo)."""
    rows, columns = cells.shape
    for k in range(readings.shape[0]):
        reading = readings[k]
        cosine, sine = math.cos(reading[2]), math.sin(reading[2])
        r0, r1, c0, c1 = box(reading, half_width, rows, columns)
        for row in range(r0, r1 + 1):
            for column in range(c0, c1 + 1):
                said = told(reading, cosine, sine, row, column, half_width)
                if said != 0.0:
                    new = values[k] if said > 0.0 else 0.0
                    cells[row, column] = mixed(cells[row, column], new, old_weight, new_weight)


@kernel
def enter_centre_lines(
    readings: FloatArray,
    values: FloatArray,
    old_weight: float,
    new_weight: float,
    cells: FloatArray,
) -> None:
    """Mix the value of every reading into its end cell, and 0 into the cells on the axis before it (ICL)."""
    rows, columns = cells.shape
    for k in range(readings.shape[0]):
        x0, y0, yaw = readings[k, 0], readings[k, 1], readings[k, 2]
        free, obstacle = readings[k, 3], readings[k, 4]
        length = obstacle if obstacle >= 0.0 else free
        last = math.ceil(2.0 * length)
        row = column = -1
        end_row, end_column = math.floor(y0 + length * math.sin(yaw)), math.floor(x0 + length * math.cos(yaw))
        for step in range(last + 1):
            d = length * step / max(last, 1)
            r, c = math.floor(y0 + d * math.sin(yaw)), math.floor(x0 + d * math.cos(yaw))
            if (r == row and c == column) or not (0 <= r < rows and 0 <= c < columns):
                continue
            row, column = r, c
            at_end = obstacle >= 0.0 and r == end_row and c == end_column
            cells[r, c] = mixed(cells[r, c], values[k] if at_end else 0.0, old_weight, new_weight)


@kernel
def mixed(old: float, new: float, old_weight: float, new_weight: float) -> float:
    """Value of a cell after one reading (pi-map, equation 7); an unknown one takes the new value."""
    return new if math.isnan(old) else min(old_weight * old + new_weight * new, 1.0)
