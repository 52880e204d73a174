"""A hammer's blow on modes by an independent solver, of eighth order (DOP853)."""

import numpy as np
from scipy.integrate import solve_ivp


def solved_blow(mass, velocity, stiffness, exponent, damping, modes, times):
    """Impulse (N s), displacement (m) and speed (m/s) of the struck point at `times`, which begin at the contact.

    `modes` are frequencies, decays, masses and shapes. Steps are far finer than what is asked of the point: its
    displacement is a small difference of modes that ring for hundreds of periods.
    """
    frequencies, decays, masses, shapes = (np.asarray(values) for values in modes)
    count = frequencies.size
    size = 3 + 2 * count
    way, speed = slice(2, 2 + count), slice(2 + count, 2 + 2 * count)  # of the modes; before them those of the hammer
    free, pushed, depths = np.zeros((size, size)), np.zeros(size), np.zeros((2, size))
    free[0, 1] = 1.0
    free[way, speed] = np.eye(count)
    free[speed, way] = -np.diag((2 * np.pi * frequencies) ** 2 + decays**2)
    free[speed, speed] = -2 * np.diag(decays)
    pushed[1], pushed[speed], pushed[-1] = -1.0 / mass, shapes / masses, 1.0
    depths[0, 0], depths[0, way], depths[1, 1], depths[1, speed] = 1.0, -shapes, 1.0, -shapes

    def motion(_, y):
        depth, closing = depths @ y
        force = max(stiffness * max(depth, 0.0) ** exponent * (1 + damping * closing), 0.0)
        return free @ y + force * pushed

    reduced = 1 / (1 / mass + (shapes**2 / masses).sum())
    deepest = ((exponent + 1) * reduced * velocity**2 / (2 * stiffness)) ** (1 / (exponent + 1))
    lasts = 3 * deepest / velocity
    start = np.zeros(size)
    start[1] = velocity
    scale = np.concatenate([[deepest, velocity], [deepest] * count, [velocity] * count, [mass * velocity]])
    parts = []
    middle = min(6 * lasts, times[-1])
    for first, last, step in ((0.0, middle, lasts / 50), (middle, times[-1], np.inf)):
        inside = times[(times > first) & (times <= last)] if first > 0 else times[times <= last]
        if last > first:
            at = np.append(inside[inside < last], last)  # the next part begins at the state there
            part = solve_ivp(motion, (first, last), start, "DOP853", at, rtol=1e-12, atol=1e-13 * scale, max_step=step)
            start = part.y[:, -1]
            parts.append(part.y[:, : inside.size])
    y = np.concatenate(parts, axis=1)
    return y[-1], shapes @ y[way], shapes @ y[speed]
