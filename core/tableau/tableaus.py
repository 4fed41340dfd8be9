#!/usr/bin/env python3
"""Coefficients of the implicit tableaus, of verner6 and of rodas4, for *_tableaus.hpp beside this file.

Works in decimals of 60 digits and prints each number with the 17 that a double holds. A tableau has its A, b, c from
their defining equations; the weights of dense output,

    y(t + theta h) = y0 + h sum_i b_i(theta) k_i,     b_i(theta) = sum_j d_ij theta^j,   j = 1..degree

solve, of all solutions the one with the least sum of d_ij^2,

    sum_i d_ij Phi_i(tree) = [order(tree) == j] / gamma(tree)    every rooted tree up to the dense order, every power j
    sum_j d_ij = b_i                                             it ends at the step's result

(Hairer, Norsett, Wanner, "Solving Ordinary Differential Equations I", sections II.2 and II.6, for Phi and gamma).
Run without arguments; needs nothing but Python 3.
"""

from decimal import Decimal as D
from decimal import getcontext

getcontext().prec = 60
ZERO = D(1).scaleb(-40)  # what is smaller came from rounding


def trees(order):
    """Rooted trees with that many nodes; a tree is the sorted tuple of its root's children."""
    if order == 1:
        return [()]
    found = set()
    for smaller in range(1, order):
        for t in trees(order - smaller):
            for child in trees(smaller):
                found.add(tuple(sorted(t + (child,))))
    return sorted(found)


def nodes(tree):
    return 1 + sum(nodes(child) for child in tree)


def gamma(tree):
    product = nodes(tree)
    for child in tree:
        product *= gamma(child)
    return product


def phi(A, tree):
    """Phi_i(tree), the elementary weight at each stage."""
    out = [D(1)] * len(A)
    for child in tree:
        inner = phi(A, child)
        out = [x * sum(a * y for a, y in zip(row, inner)) for x, row in zip(out, A)]
    return out


def solve(rows, right):
    """The solution of least norm of a consistent system, x = R' z with R R' z = right; dependent rows drop out."""
    kept, kept_right = [], []
    for row, value in zip(rows, right):  # Gram-Schmidt
        row = list(row)
        for q, v in zip(kept, kept_right):
            along = sum(x * y for x, y in zip(row, q))
            row = [x - along * y for x, y in zip(row, q)]
            value -= along * v
        norm = sum(x * x for x in row).sqrt()
        if norm < ZERO:
            assert abs(value) < ZERO, "the conditions contradict each other"
            continue
        kept.append([x / norm for x in row])
        kept_right.append(value / norm)
    return [sum(v * q[i] for q, v in zip(kept, kept_right)) for i in range(len(rows[0]))]


def dense_weights(A, b, order, degree):
    stages = len(A)
    b = b + [D(0)] * (stages - len(b))
    rows, right = [], []
    for i in range(stages):
        rows.append([D(k // degree == i) for k in range(stages * degree)])
        right.append(b[i])
    for n in range(1, order + 1):
        for tree in trees(n):
            weight = phi(A, tree)
            for j in range(1, degree + 1):
                rows.append([weight[k // degree] * (k % degree == j - 1) for k in range(stages * degree)])
                right.append(D(n == j) / gamma(tree))
    x = solve(rows, right)
    return [x[i * degree : (i + 1) * degree] for i in range(stages)]


def times(p, q):
    out = [D(0)] * (len(p) + len(q) - 1)
    for i, x in enumerate(p):
        for j, y in enumerate(q):
            out[i + j] += x * y
    return out


def lagrange(c, j):
    """Coefficients of the polynomial that is 1 at c_j, 0 at the other nodes."""
    p = [D(1)]
    for k, x in enumerate(c):
        if k != j:
            p = times(p, [-x / (c[j] - x), 1 / (c[j] - x)])
    return p


def at(p, x):
    value = D(0)
    for a in reversed(p):
        value = value * x + a
    return value


def integral(p, x):
    return x * at([a / (k + 1) for k, a in enumerate(p)], x)


def collocation(c):
    basis = [lagrange(c, j) for j in range(len(c))]
    return [[integral(p, x) for p in basis] for x in c], [integral(p, D(1)) for p in basis]


def with_start(c, A, b):
    """Stage 0: f at the step's start."""
    return [D(0)] + c, [[D(0)] * (len(c) + 1)] + [[D(0)] + row for row in A], [D(0)] + b


def with_explicit_stage(c, A, c_new, row):
    """One more explicit stage."""
    stages = len(A)
    A = [r + [D(0)] for r in A] + [row + [D(0)] * (stages + 1 - len(row))]
    return c + [c_new], A


def difference_weights(c):
    """Of the divided difference over the nodes, scaled to 1 at the first."""
    w = []
    for i, x in enumerate(c):
        product = D(1)
        for k, y in enumerate(c):
            if k != i:
                product *= x - y
        w.append(1 / product)
    return [x / w[0] for x in w]


def real_eigenvalue(A):
    """The only real one of a 3 x 3 matrix, from its characteristic polynomial, by Newton from above."""
    trace = A[0][0] + A[1][1] + A[2][2]
    minors = sum(A[i][i] * A[j][j] - A[i][j] * A[j][i] for i, j in ((0, 1), (0, 2), (1, 2)))
    det = sum(A[0][i] * (A[1][(i + 1) % 3] * A[2][(i + 2) % 3] - A[1][(i + 2) % 3] * A[2][(i + 1) % 3]) for i in range(3))
    x = trace
    for _ in range(200):
        x -= (((x - trace) * x + minors) * x - det) / ((3 * x - 2 * trace) * x + minors)
    return x


def trbdf2():
    """Bank et al. 1985; the estimate by Hosea and Shampine 1996: b minus the weights of order 3."""
    root = D(2).sqrt()
    g, w = 1 - root / 2, root / 4
    c = [D(0), 2 * g, D(1)]
    A = [[D(0)] * 3, [g, g, D(0)], [w, w, g]]
    b = A[2]
    high = [(1 - w) / 3, (3 * w + 1) / 3, g / 3]
    return c, A, b, [x - y for x, y in zip(b, high)], g


def kennedy_carpenter3():
    """ARK3(2)4L[2]SA, its implicit method: stage order 2, c3 = 3/5, gamma the root of 6x^3 - 18x^2 + 9x - 1."""
    g = D("0.4358665215")
    for _ in range(100):
        g -= (((6 * g - 18) * g + 9) * g - 1) / ((18 * g - 36) * g + 9)
    c = [D(0), 2 * g, D(3) / 5, D(1)]
    a32 = (c[2] ** 2 / 2 - g * c[2]) / c[1]
    b = solve([[D(1)] * 3, c[:3], [x * x for x in c[:3]]], [1 - g, D(1) / 2 - g, D(1) / 3 - g]) + [g]
    A = [[D(0)] * 4, [g, g, D(0), D(0)], [c[2] - g - a32, a32, g, D(0)], b]
    low = [D(2756255671327) / D(12835298489170), -D(10771552573575) / D(22201958757719),
           D(9247589265047) / D(10645013368117), D(2193209047091) / D(5459859503100)]
    return c, A, b, [x - y for x, y in zip(b, low)], g


def kennedy_carpenter4():
    """ARK4(3)6L[2]SA, its implicit method."""
    g = D(1) / 4
    c = [D(0), D(1) / 2, D(83) / 250, D(31) / 50, D(17) / 20, D(1)]
    b = [D(82889) / 524892, D(0), D(15625) / 83664, D(69875) / 102672, -D(2260) / 8211, g]
    A = [[D(0)] * 6,
         [g, g] + [D(0)] * 4,
         [D(8611) / 62500, -D(1743) / 31250, g] + [D(0)] * 3,
         [D(5012029) / 34652500, -D(654441) / 2922500, D(174375) / 388108, g] + [D(0)] * 2,
         [D(15267082809) / 155376265600, -D(71443401) / 120774400, D(730878875) / 902184768, D(2285395) / 8070912, g,
          D(0)],
         b]
    low = [D(4586570599) / 29645900160, D(0), D(178811875) / 945068544, D(814220225) / 1159782912,
           -D(3700637) / 11593932, D(61727) / 225920]
    return c, A, b, [x - y for x, y in zip(b, low)], g


def radau5():
    """Radau IIA; the estimate: Hairer and Wanner II, section IV.8, gamma0 (k_0 - extrapolation of the stages to 0)."""
    r = D(6).sqrt()
    c = [(4 - r) / 10, (4 + r) / 10, D(1)]
    A, b = collocation(c)
    g = real_eigenvalue(A)
    error = [g] + [-g * at(lagrange(c, j), D(0)) for j in range(3)]
    c, A, b = with_start(c, A, b)
    return c, A, b, error, g


def lobatto3c():
    """Lobatto IIIC with three nodes: Hairer and Wanner II, table IV.5.7. The estimate: gamma0 times the second
    difference of f over f(y0) and the stages at 1/2 and 1."""
    b = [D(1) / 6, D(2) / 3, D(1) / 6]
    c, A, b = with_start([D(0), D(1) / 2, D(1)], [[b[0], -D(1) / 3, b[0]], [b[0], D(5) / 12, -D(1) / 12], b], b)
    g = real_eigenvalue([row[1:] for row in A[1:]])
    return c, A, b, [g, D(0), -2 * g, g], g


def radau1a():
    """Radau IA with three nodes, c the zeros of Radau's polynomial from the left: Hairer and Wanner II, section IV.5.
    A from D(3): sum_i b_i c_i^(q-1) a_ij = b_j (1 - c_j^q)/q. With f(y1), and the estimate of the Gauss methods over 0,
    the inner nodes and 1."""
    r = D(6).sqrt()
    c = [D(0), (6 - r) / 10, (6 + r) / 10]
    b = collocation(c)[1]
    A = [[D(0)] * 3 for _ in c]
    for j in range(3):
        rows = [[b[i] * (c[i] ** (q - 1) if q > 1 else 1) for i in range(3)] for q in (1, 2, 3)]
        column = solve(rows, [b[j] * (1 - c[j] ** q) / q for q in (1, 2, 3)])
        for i in range(3):
            A[i][j] = column[i]
    g = real_eigenvalue(A)
    c, A, b = with_start(c, A, b)
    w = difference_weights([D(0), c[2], c[3], D(1)])
    error = [g * x for x in [w[0], D(0)] + w[1:]]
    c, A = with_explicit_stage(c, A, D(1), b)
    return c, A, b + [D(0)], error, g


def gauss(c, g):
    """With f(y0) and f(y1); the estimate: gamma0 times the divided difference of f over 0 and the nodes, its weight 1 at
    0. (Over 1 as well it would vanish wherever f is linear: f(u) has the degree of the collocation polynomial u then.)"""
    A, b = collocation(c)
    c, A, b = with_start(c, A, b)
    error = [g * x for x in difference_weights(c)] + [D(0)]
    c, A = with_explicit_stage(c, A, D(1), b)
    return c, A, b + [D(0)], error, g


def gauss4():
    r = D(3).sqrt() / 6
    return gauss([D(1) / 2 - r, D(1) / 2 + r], 1 / D(12).sqrt())


def gauss6():
    r = D(15).sqrt() / 10
    c = [D(1) / 2 - r, D(1) / 2, D(1) / 2 + r]
    return gauss(c, real_eigenvalue(collocation(c)[0]))


def verner6():
    """Verner's "most robust" pair of orders 6 and 5; its ninth stage is f(y1)."""
    def row(*x):
        return [D(y[0]) / D(y[1]) if isinstance(y, tuple) else D(y) for y in x]

    c = row(0, (9, 50), (1, 6), (1, 4), (53, 100), (3, 5), (4, 5), 1, 1)
    rows = [[], row((9, 50)), row((29, 324), (25, 324)), row((1, 16), 0, (3, 16)),
            row((79129, 250000), 0, (-261237, 250000), (19663, 15625)),
            row((1336883, 4909125), 0, (-25476, 30875), (194159, 185250), (8225, 78546)),
            row((-2459386, 14727375), 0, (19504, 30875), (2377474, 13615875), (-6157250, 5773131), (902, 735)),
            row((2699, 7410), 0, (-252, 1235), (-1393253, 3993990), (236875, 72618), (-135, 49), (15, 22)),
            row((11, 144), 0, 0, (256, 693), 0, (125, 504), (125, 528), (5, 72))]
    A = [r + [D(0)] * (9 - len(r)) for r in rows]
    low = row((28, 477), 0, 0, (212, 441), (-312500, 366177), (2125, 1764), 0, (-2105, 35532), (2995, 17766))
    return c, A, A[8], [x - y for x, y in zip(A[8], low)], D(0)


def rodas4():
    """RODAS of Hairer and Wanner, from the form that they publish: (1/(h g) - f_y) u_i = f(y0 + sum_j A_ij u_j)
    + sum_j C_ij u_j/h + h gamma_i f_t, y1 = y0 + sum_i m_i u_i, into that of method.hpp. u = h Gamma k, and
    C = diag(1/g) - inv(Gamma); dense output y0 + theta (sum m u + (1 - theta) (sum D2 u + theta sum D3 u))."""
    def rows(*text):
        return [[D(x) for x in row.split()] + [D(0)] * (6 - len(row.split())) for row in text]

    a5 = "1.221224509226641 6.019134481288629 12.53708332932087 -0.6878860361058950"
    A = rows("", "1.544", "0.9466785280815826 0.2557011698983284",
             "3.314825187068521 2.896124015972201 0.9986419139977817", a5, a5 + " 1")
    C = rows("", "-5.6688", "-2.430093356833875 -0.2063599157091915",
             "-0.1073529058151375 -9.594562251023355 -20.47028614809616",
             "7.496443313967647 -10.24680431464352 -33.99990352819905 11.70890893206160",
             "8.083246795921522 -7.981132988064893 -31.52159432874371 16.31930543123136 -6.058818238834054")
    D2, D3, m, e = rows("10.12623508344586 -7.487995877610167 -34.80091861555747 -7.992771707568823 1.025137723295662",
                        "-0.6762803392806898 6.087714651680015 16.43084320892478 24.76722511418386 -6.594389125716872",
                        a5 + " 1 1", "0 0 0 0 0 1")
    g = D("0.25")
    n = range(6)
    inverse = [[(1 / g if i == j else D(0)) - C[i][j] for j in n] for i in n]
    gammas = [[D(0)] * 6 for _ in n]
    for j in n:
        for i in range(j, 6):
            right = D(i == j) - sum(inverse[i][k] * gammas[k][j] for k in range(j, i))
            gammas[i][j] = right / inverse[i][i]

    def of_k(weights):
        return [sum(weights[k] * gammas[k][j] for k in n) for j in n]

    powers = [[x + y for x, y in zip(m, D2)], [y - x for x, y in zip(D2, D3)], [-x for x in D3]]
    dense = [list(w) for w in zip(*(of_k(p) for p in powers))]
    return [of_k(row) for row in A], gammas, of_k(m), of_k(e), dense


def order_of(A, b, up_to=8):
    b = b + [D(0)] * (len(A) - len(b))
    for n in range(1, up_to + 1):
        for tree in trees(n):
            if abs(sum(x * y for x, y in zip(b, phi(A, tree))) - D(1) / gamma(tree)) > D(10) ** -20:
                return n - 1
    return up_to


def print_rows(label, rows):
    for row in rows:
        row = [x if abs(x) > ZERO else D(0) for x in row]
        while len(row) > 1 and row[-1] == 0:
            row.pop()
        print(f"  {label:6}" + "{" + ", ".join(f"{float(x)!r}" for x in row) + "},")


def show(name, c, A, b, error, filter, dense_order, degree, stages=None):
    stages = stages or len(b)
    dense = dense_weights(A, b, dense_order, degree)
    low = [x - y for x, y in zip(b, error)]
    print(f"{name}: order {order_of(A, b)}, of the estimate's formula {order_of(A, low)}, filter {float(filter)!r}")
    for label, rows in (("c", [c]), ("A", A), ("b", [b[:stages]]), ("error", [error]), ("dense", dense)):
        print_rows(label, rows)


def main():
    show("sdirk2", *trbdf2(), 2, 2)
    show("sdirk3", *kennedy_carpenter3(), 3, 3)
    show("sdirk4", *kennedy_carpenter4(), 4, 4)
    show("radau5", *radau5(), 4, 4)
    show("lobatto3c", *lobatto3c(), 3, 3)
    show("radau1a", *radau1a(), 4, 4)
    show("gauss4", *gauss4(), 3, 3)
    for name, (c, A, b, error, g) in (("gauss6", gauss6()), ("verner6", verner6())):
        # A state of order 4 in the middle gives one more stage, and with it order 5; weights are smallest for it there.
        theta = D(1) / 2
        row = [sum(x * theta**(j + 1) for j, x in enumerate(w)) for w in dense_weights(A, b, 4, 5)]
        stages = len(b)
        c, A = with_explicit_stage(c, A, theta, row)
        show(name, c, A, b, error, g, 5, 5, stages)
    print("rodas4")
    A, gammas, b, error, dense = rodas4()
    for label, rows in (("A", A), ("gamma", gammas), ("b", [b]), ("error", [error]), ("dense", dense)):
        print_rows(label, rows)


main()
