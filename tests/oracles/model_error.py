"""Naive, dense, textbook solutions against which the model error estimators are held. They share no code with them."""

from __future__ import annotations

import decimal

import numpy as np
from scipy.linalg import block_diag, expm


def dense_discrete(F, H, b, y, x0, Q1, Q2_inverse, S0):
    """Minimiser of J over all states and all d of x(j+1) = F x(j) + b(j) + d(j): ((N, n), (N-1, n), covariance).

    J = sum (y - Hx)' Q1 (y - Hx) + sum d' Q2 d + 1/2 (x(0) - x0)' S0^-1 (x(0) - x0), Q2_inverse and S0 regular; the
    covariance of (x(0), d(0), d(1), ...) is that of a Gaussian exp(-J/2) with its a-priori term halved likewise.
    Rows of y that are NaN are left out. Unknowns are z = (x(0), d(0), .., d(N-2)).
    """
    N, n = len(y), len(x0)
    count = n * N
    maps, offsets = [np.zeros((n, count))], [np.zeros(n)]
    maps[0][:, :n] = np.eye(n)
    for j in range(N - 1):
        step = F[j] @ maps[j]
        step[:, n * (j + 1) : n * (j + 2)] += np.eye(n)
        maps.append(step)
        offsets.append(F[j] @ offsets[j] + b[j])
    A = np.zeros((count, count))
    right = np.zeros(count)
    A[:n, :n] += 0.5 * np.linalg.inv(S0)
    right[:n] += 0.5 * np.linalg.inv(S0) @ x0
    for j in range(N - 1):
        block = slice(n * (j + 1), n * (j + 2))
        A[block, block] += np.linalg.inv(Q2_inverse)
    for j in range(N):
        held = ~np.isnan(y[j])
        M = (H[j] @ maps[j])[held]
        Q = Q1[np.ix_(held, held)]
        A += M.T @ Q @ M
        right += M.T @ Q @ (y[j] - H[j] @ offsets[j])[held]
    z = np.linalg.solve(A, right)
    x = np.array([m @ z + o for m, o in zip(maps, offsets, strict=True)])
    covariance = np.linalg.inv(A)
    x_covariance = np.array([m @ covariance @ m.T for m in maps])
    d_covariance = np.array([covariance[n * (j + 1) : n * (j + 2), n * (j + 1) : n * (j + 2)] for j in range(N - 1)])
    return x, z[n:].reshape(N - 1, n), x_covariance, d_covariance


def kalman_filter(F, H, b, y, x0, P0, Q, R):
    """Textbook Kalman filter with its update at every sample, also the first: (states, covariances, predictions)."""
    x, P = np.array(x0, dtype=float), np.array(P0, dtype=float)
    states, covariances, predicted, predicted_covariances = [], [], [], []
    for j in range(len(y)):
        if j > 0:
            x = F[j - 1] @ x + b[j - 1]
            P = F[j - 1] @ P @ F[j - 1].T + Q
        predicted.append(x)
        predicted_covariances.append(P)
        K = P @ H[j].T @ np.linalg.inv(H[j] @ P @ H[j].T + R)
        x = x + K @ (y[j] - H[j] @ x)
        P = (np.eye(len(x)) - K @ H[j]) @ P
        states.append(x)
        covariances.append(P)
    return np.array(states), np.array(covariances), np.array(predicted), np.array(predicted_covariances)


def rauch_tung_striebel(F, H, b, y, x0, P0, Q, R):
    """Textbook smoother on `kalman_filter`: (states, covariances, covariances of d(j) = x(j+1) - F x(j) - b(j))."""
    states, covariances, predicted, predicted_covariances = kalman_filter(F, H, b, y, x0, P0, Q, R)
    x, P = states.copy(), covariances.copy()
    d_covariances = np.zeros((len(y) - 1, *P.shape[1:]))
    for j in range(len(y) - 2, -1, -1):
        G = covariances[j] @ F[j].T @ np.linalg.inv(predicted_covariances[j + 1])
        x[j] = states[j] + G @ (x[j + 1] - predicted[j + 1])
        P[j] = covariances[j] + G @ (P[j + 1] - predicted_covariances[j + 1]) @ G.T
        cross = P[j + 1] @ G.T  # covariance of x(j+1) with x(j) given the whole record
        d_covariances[j] = P[j + 1] - cross @ F[j].T - F[j] @ cross.T + F[j] @ P[j] @ F[j].T
    return x, P, d_covariances


def riccati_rates(F, W, C, S):
    """Right-hand side of (22): S' = F S + S F' - S C S + W with W = (1/2) Q2^-1, C = 2 H' Q1 H."""
    return F @ S + S @ F.T - S @ C @ S + W


def exponential_step(S, F, W, C, g0, g1, dt):
    """S and e at the end of a step from the matrix exponential of (25), (26) with the forcing g linear in time."""
    n = len(F)
    A = np.zeros((2 * n + 2, 2 * n + 2))
    A[:n, :n], A[:n, n : 2 * n], A[n : 2 * n, :n], A[n : 2 * n, n : 2 * n] = F, W, C, -F.T
    A[n : 2 * n, 2 * n], A[n : 2 * n, 2 * n + 1] = -g0, -(g1 - g0) / dt
    A[2 * n + 1, 2 * n] = 1.0
    M = expm(A * dt)
    a, b, z = M[:n, :n] @ S + M[:n, n : 2 * n], M[n : 2 * n, :n] @ S + M[n : 2 * n, n : 2 * n], M[: 2 * n, 2 * n]
    costate = -np.linalg.solve(b, z[n:])  # lambda = 0 at the end, x = S lambda at the beginning
    return a @ np.linalg.inv(b), a @ costate + z[:n]


def decimal_step(S, F, W, C, g0, g1, dt, digits):
    """As `exponential_step` in decimal arithmetic of so many digits, where growth cancels without loss."""
    with decimal.localcontext(prec=digits):
        exact = np.vectorize(lambda value: decimal.Decimal(float(value)), otypes=[object])
        n = len(F)
        dt = decimal.Decimal(dt)
        A = exact(np.zeros((2 * n + 2, 2 * n + 2)))
        A[:n, :n], A[:n, n : 2 * n] = exact(F) * dt, exact(W) * dt
        A[n : 2 * n, :n], A[n : 2 * n, n : 2 * n] = exact(C) * dt, exact(-F.T) * dt
        A[n : 2 * n, 2 * n], A[n : 2 * n, 2 * n + 1] = exact(-g0) * dt, exact(g0) - exact(g1)
        A[2 * n + 1, 2 * n] = dt
        halvings = max(0, int(np.ceil(np.log2(float(np.abs(A).sum(axis=1).max())))))
        A = A / decimal.Decimal(2) ** halvings
        M = term = exact(np.eye(2 * n + 2))
        for k in range(1, digits):
            term = term @ A / decimal.Decimal(k)
            M = M + term
        for _ in range(halvings):
            M = M @ M
        a, b = M[:n, :n] @ exact(S) + M[:n, n : 2 * n], M[n : 2 * n, :n] @ exact(S) + M[n : 2 * n, n : 2 * n]
        system = np.hstack([b.T, a.T])  # S+ = a b^-1, by elimination on b' S+' = a'
        for k in range(n):
            pivot = k + int(np.argmax(np.abs(system[k:, k])))
            system[[k, pivot]] = system[[pivot, k]]
            system[k] = system[k] / system[k, k]
            for i in range(n):
                if i != k:
                    system[i] = system[i] - system[k] * system[i, k]
        S_next = system[:, n:].T
        e = M[:n, 2 * n] - S_next @ M[n : 2 * n, 2 * n]
        return S_next.astype(float), e.astype(float)


def dense_boundary_value(F, H, b, time, y, x0, Q1, Q2_inverse, S0):
    """The two-point problem (18), (19) of x' = F x + b(t), b and y linear between the samples, as one dense system.

    Unknowns are x and lambda at every sample, one block row a step from the matrix exponential; (states, costates).
    """
    N, n = len(y), len(x0)
    A, right = np.zeros((2 * n * N, 2 * n * N)), np.zeros(2 * n * N)
    A[:n, :n], A[:n, n : 2 * n], right[:n] = np.eye(n), -S0, x0
    A[n : 2 * n, -n:] = np.eye(n)
    for k in range(N - 1):
        dt = time[k + 1] - time[k]
        B = np.zeros((2 * n + 2, 2 * n + 2))
        B[:n, :n], B[:n, n : 2 * n] = F, 0.5 * Q2_inverse
        B[n : 2 * n, :n], B[n : 2 * n, n : 2 * n] = 2.0 * H.T @ Q1 @ H, -F.T
        B[:n, 2 * n], B[:n, 2 * n + 1] = b[k], (b[k + 1] - b[k]) / dt
        B[n : 2 * n, 2 * n] = -2.0 * H.T @ Q1 @ y[k]
        B[n : 2 * n, 2 * n + 1] = -2.0 * H.T @ Q1 @ (y[k + 1] - y[k]) / dt
        B[2 * n + 1, 2 * n] = 1.0
        M = expm(B * dt)
        rows = slice(2 * n * (k + 1), 2 * n * (k + 2))
        A[rows, 2 * n * k : 2 * n * (k + 1)] = -M[: 2 * n, : 2 * n]
        A[rows, rows] = np.eye(2 * n)
        right[rows] = M[: 2 * n, 2 * n]
    z = np.linalg.solve(A, right).reshape(N, 2 * n)
    return z[:, :n], z[:, n:]


def fine_grid_minimiser(F, H, b, time, y, x0, Q1, Q2_inverse, S0, cells):
    """Minimiser of J (17) by brute force: d constant on `cells` cells a step, J by the midpoint rule; (N, n) states.

    y and b are linear between the samples. Its error falls with the square of the cell.
    """
    N, n, p = len(y), len(x0), len(y[0])
    fine = np.concatenate(
        [np.linspace(time[k], time[k + 1], cells, endpoint=False) for k in range(N - 1)] + [time[-1:]]
    )
    dt = np.diff(fine)
    middle = fine[:-1] + dt / 2
    y_middle = np.array([[np.interp(t, time, y[:, i]) for i in range(p)] for t in middle])
    b_middle = np.array([[np.interp(t, time, b[:, i]) for i in range(n)] for t in middle])
    steps = []
    for h in dt:
        big = expm(np.block([[F, np.eye(n)], [np.zeros((n, 2 * n))]]) * h)
        steps.append((big[:n, :n], big[:n, n:]))
    M, count = len(dt), n * (len(dt) + 1)
    G, o = np.zeros((n, count)), np.zeros(n)
    G[:, :n] = np.eye(n)
    A = np.zeros((count, count))
    A[:n, :n] = 0.5 * np.linalg.inv(S0)
    right = np.zeros(count)
    right[:n] = 0.5 * np.linalg.inv(S0) @ x0
    at_samples = [(G, o)]
    for k in range(M):
        half = expm(np.block([[F, np.eye(n)], [np.zeros((n, 2 * n))]]) * dt[k] / 2)
        mid, mid_o = half[:n, :n] @ G, half[:n, :n] @ o + half[:n, n:] @ b_middle[k]
        mid[:, n * (k + 1) : n * (k + 2)] += half[:n, n:]
        A += dt[k] * mid.T @ H.T @ Q1 @ H @ mid
        right += dt[k] * mid.T @ H.T @ Q1 @ (y_middle[k] - H @ mid_o)
        block = slice(n * (k + 1), n * (k + 2))
        A[block, block] += dt[k] * np.linalg.inv(Q2_inverse)
        G, o = steps[k][0] @ G, steps[k][0] @ o + steps[k][1] @ b_middle[k]
        G[:, block] += steps[k][1]
        if (k + 1) % cells == 0:
            at_samples.append((G.copy(), o.copy()))
    z = np.linalg.solve(A, right)
    return np.array([g @ z + offset for g, offset in at_samples])


def split_covariance(F, H, time, Q1, Q2_inverse, S0, cells):
    """Covariances of x at the samples and of the mean of d over each step, by a smoother on a fine grid.

    d is white of density Q2_inverse and is carried as an integral beside the state that is emptied at each sample; y is
    continuous with white noise of density Q1^-1, sampled in every cell.
    """
    n, p = len(F), len(H)
    F2 = block_diag(F, np.zeros((n, n)))
    G = np.vstack([np.eye(n), np.eye(n)])
    H2 = np.hstack([H, np.zeros((p, n))])
    empty = block_diag(np.eye(n), np.zeros((n, n)))
    maps, noises = [], []
    for k in range(len(time) - 1):
        h = (time[k + 1] - time[k]) / cells
        big = expm(np.block([[-F2, G @ Q2_inverse @ G.T], [np.zeros((2 * n, 2 * n)), F2.T]]) * h)
        Phi = big[2 * n :, 2 * n :].T
        for i in range(cells):
            maps.append(Phi @ empty if i == 0 else Phi)
            noises.append(Phi @ big[: 2 * n, 2 * n :])
    h = time[1] - time[0]
    R = np.linalg.inv(Q1) / (h / cells)
    P = block_diag(2.0 * S0, np.zeros((n, n)))
    filtered, predicted = [P], [P]
    for Phi, Q in zip(maps, noises, strict=True):
        # Half of the information before the step of the cell and half after it: second order in the cell.
        P = _update(P, H2, 2.0 * R)
        filtered[-1] = P
        P = Phi @ P @ Phi.T + Q
        predicted.append(P)
        P = _update(P, H2, 2.0 * R)
        filtered.append(P)
    smoothed = list(filtered)
    for k in range(len(maps) - 1, -1, -1):
        gain = filtered[k] @ maps[k].T @ np.linalg.pinv(predicted[k + 1], rcond=1e-14)
        smoothed[k] = filtered[k] + gain @ (smoothed[k + 1] - predicted[k + 1]) @ gain.T
    x = np.array([s[:n, :n] for s in smoothed[::cells]])
    d = np.array([s[n:, n:] for s in smoothed[cells::cells]])
    return x, d / np.diff(time)[:, None, None] ** 2


def _update(P, H, R):
    K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
    return (np.eye(len(P)) - K @ H) @ P
