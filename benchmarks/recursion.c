/* The model-error recursion (21)-(26) of Parameswaran & Raol 1994 on the aircraft's equations (33)-(36), in plain C.
 *
 * The limit that the compiled Python is measured against: the algorithm of aerosid/model_error/aircraft_error/recursion.py (states, d and
 * Riccati matrix; no candidates, no likelihood) and of aerosid/model_error/invariant_embedding/estimator_step.py, with sizes known to
 * the compiler and all work arrays on the stack. The aircraft is data here as well: a table of terms, interpreted.
 */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

enum {
    N = 4,              /* u, w, q, theta of the estimator */
    H = 2 * N,          /* the Hamiltonian */
    CONSTANT = 2,       /* forcing columns: g0 and g1 - g0 */
    K = 2 * CONSTANT,   /* and their ramps; that of g0 only fills rows to whole vector registers */
    FIXED = 15,         /* alpha, q_hat, V_hat, alpha_dot_hat, C_T, mach; lateral ones, which are inputs here */
    MOST_SLOTS = 64
};

static const double GRAVITY = 9.80665;
static const double ALPHA_LIMIT = 1.5;
static const double SHORT_STEP_NORM = 1.0 / 11.0;
static const int MOST_DOUBLINGS = 60;
static const double EPSILON = 2.220446049250313e-16;

typedef struct {
    int64_t terms;
    const int64_t *coefficient, *first, *variable, *shape, *power;
    const double *offset, *values;
    bool alpha_dot_used;
} Terms;

typedef struct {
    double wing_area, mean_chord, I_yy, thrust_incidence, thrust_z_arm, airspeed_of_rates, airspeed_of_V_hat;
} Constants;

/* One step in balanced units, what meets in one product side by side. */
typedef struct {
    double ahead[N][H + K]; /* Q | c_x | Phi - I */
    double back[N][N + K];  /* -c_lambda | G */
    double scale[N];
} Map;

static double power_of(double x, int64_t n)
{
    double value = 1.0;
    for (int64_t i = 0; i < n; i++)
        value *= x;
    return value;
}

static double shaped(const Terms *t, int64_t f, const double *variables)
{
    double x = variables[t->variable[f]] - t->offset[f];
    return t->shape[f] == 1 ? fabs(x) : t->shape[f] == 2 ? fmax(x, 0.0) : x;
}

static void sum_coefficients(const Terms *t, const double *variables, int slots, double c[5],
                             double c_v[5][MOST_SLOTS], bool differentiate)
{
    for (int row = 0; row < 5; row++) {
        c[row] = 0.0;
        if (differentiate)
            memset(c_v[row], 0, (size_t)slots * sizeof(double));
    }
    for (int64_t i = 0; i < t->terms; i++) {
        int64_t row = t->coefficient[i];
        double value = 1.0;
        for (int64_t f = t->first[i]; f < t->first[i + 1]; f++)
            value *= power_of(shaped(t, f, variables), t->power[f]);
        c[row] += t->values[i] * value;
        if (!differentiate || t->values[i] == 0.0)
            continue;
        for (int64_t f = t->first[i]; f < t->first[i + 1]; f++) {
            double others = 1.0;
            for (int64_t g = t->first[i]; g < t->first[i + 1]; g++)
                if (g != f)
                    others *= power_of(shaped(t, g, variables), t->power[g]);
            double x = variables[t->variable[f]] - t->offset[f];
            int64_t n = t->power[f];
            double slope;
            if (t->shape[f] == 1)
                slope = (double)n * power_of(fabs(x), n - 1) * (double)((x > 0.0) - (x < 0.0));
            else if (t->shape[f] == 2)
                slope = x > 0.0 ? (double)n * power_of(x, n - 1) : 0.0;
            else
                slope = (double)n * power_of(x, n - 1);
            c_v[row][t->variable[f]] += t->values[i] * others * slope;
        }
    }
}

/* Rates f of u, w, q, theta, h and, if wanted, f_x of the first four. */
static void evaluate(const double x[5], const double *input, int columns, const Terms *terms, const Constants *k,
                     double f[5], double f_x[N][N], bool differentiate)
{
    double variables[MOST_SLOTS], c[5], c_v[5][MOST_SLOTS];
    double u = x[0], w = x[1], q = x[2], theta = x[3];
    double density = input[0], thrust = input[1], mass = input[2], sound = input[3];
    double phi = input[4], p = input[5], r = input[6], beta = input[7];
    double square = u * u + w * w, plane = sqrt(square);
    double cos_beta = 1.0, tan_beta = 0.0, sin_phi = 0.0, cos_phi = 1.0; /* most flights hold neither beta nor phi */
    if (beta != 0.0) {
        cos_beta = cos(beta);
        tan_beta = tan(beta);
    }
    if (phi != 0.0) {
        sin_phi = sin(phi);
        cos_phi = cos(phi);
    }
    double speed = plane / cos_beta, v = plane * tan_beta;
    double sin_alpha = w / plane, cos_alpha = u / plane;
    bool current = k->airspeed_of_rates <= 0.0;
    double half_chord = k->mean_chord / (2.0 * (current ? speed : k->airspeed_of_rates));
    double pressure_area = 0.5 * density * speed * speed * k->wing_area;
    double sin_theta = sin(theta), cos_theta = cos(theta);
    double force = pressure_area / mass, moment = pressure_area * k->mean_chord / k->I_yy;
    double inertial_u = -GRAVITY * sin_theta - q * w + r * v;
    double inertial_w = GRAVITY * cos_theta * cos_phi + q * u - p * v;
    double thrust_u = thrust / mass, thrust_w = 0.0;
    if (k->thrust_incidence != 0.0) {
        thrust_w = -thrust_u * sin(k->thrust_incidence);
        thrust_u *= cos(k->thrust_incidence);
    }
    int slots = FIXED + columns, passes = terms->alpha_dot_used ? 3 : 1;
    double slope = 0.0;

    variables[0] = atan2(w, u);
    variables[1] = q * half_chord;
    variables[2] = speed / k->airspeed_of_V_hat - 1.0;
    variables[3] = 0.0;
    variables[4] = thrust / pressure_area;
    variables[5] = speed / sound;
    for (int j = 0; j < columns; j++)
        variables[FIXED + j] = input[j];
    for (int i = 0; i < passes; i++) {
        sum_coefficients(terms, variables, slots, c, c_v, differentiate || terms->alpha_dot_used);
        f[0] = force * (c[0] + c[3] * sin_alpha - c[4] * cos_alpha) + thrust_u + inertial_u;
        f[1] = force * (c[1] - c[3] * cos_alpha - c[4] * sin_alpha) + thrust_w + inertial_w;
        if (terms->alpha_dot_used) {
            double a_u = force * (c_v[0][3] + c_v[3][3] * sin_alpha - c_v[4][3] * cos_alpha);
            double a_w = force * (c_v[1][3] - c_v[3][3] * cos_alpha - c_v[4][3] * sin_alpha);
            slope = (u * a_w - w * a_u) / square * half_chord;
            if (i < passes - 1)
                variables[3] += ((u * f[1] - w * f[0]) / square * half_chord - variables[3]) / (1.0 - slope);
        }
    }
    f[2] = moment * c[2] + thrust * k->thrust_z_arm / k->I_yy;
    f[3] = q * cos_phi - r * sin_phi;
    f[4] = u * sin_theta - v * sin_phi * cos_theta - w * cos_phi * cos_theta;
    if (!differentiate)
        return;

    double c_x = c[0] + c[3] * sin_alpha - c[4] * cos_alpha, c_z = c[1] - c[3] * cos_alpha - c[4] * sin_alpha;
    double c_x_alpha = c[3] * cos_alpha + c[4] * sin_alpha, c_z_alpha = c[3] * sin_alpha - c[4] * cos_alpha;
    for (int j = 0; j < N; j++) {
        double d_alpha = j == 0 ? -w / square : j == 1 ? u / square : 0.0;
        double d_speed = j == 0 ? cos_alpha / cos_beta : j == 1 ? sin_alpha / cos_beta : 0.0;
        double d_q_hat = (j == 2 ? half_chord : 0.0) - (current ? variables[1] * d_speed / speed : 0.0);
        double d_c[5];
        for (int row = 0; row < 5; row++)
            d_c[row] = c_v[row][0] * d_alpha + c_v[row][1] * d_q_hat + c_v[row][2] * d_speed / k->airspeed_of_V_hat
                     - 2.0 * c_v[row][4] * variables[4] * d_speed / speed + c_v[row][5] * variables[5] * d_speed / speed;
        double pressure = 2.0 * d_speed / speed;
        f_x[0][j] = force * (d_c[0] + d_c[3] * sin_alpha - d_c[4] * cos_alpha + c_x_alpha * d_alpha + c_x * pressure);
        f_x[1][j] = force * (d_c[1] - d_c[3] * cos_alpha - d_c[4] * sin_alpha + c_z_alpha * d_alpha + c_z * pressure);
        f_x[2][j] = moment * (d_c[2] + c[2] * pressure);
        f_x[3][j] = 0.0;
    }
    f_x[0][0] += r * cos_alpha * tan_beta;
    f_x[0][1] += r * sin_alpha * tan_beta - q;
    f_x[0][2] -= w;
    f_x[0][3] -= GRAVITY * cos_theta;
    f_x[1][0] += q - p * cos_alpha * tan_beta;
    f_x[1][1] -= p * sin_alpha * tan_beta;
    f_x[1][2] += u;
    f_x[1][3] -= GRAVITY * sin_theta * cos_phi;
    f_x[3][2] = cos_phi;
    if (terms->alpha_dot_used) {
        double a_u = force * (c_v[0][3] + c_v[3][3] * sin_alpha - c_v[4][3] * cos_alpha);
        double a_w = force * (c_v[1][3] - c_v[3][3] * cos_alpha - c_v[4][3] * sin_alpha);
        double a_q = moment * c_v[2][3], hat = variables[3];
        for (int j = 0; j < N; j++) {
            double d_hat = (u * f_x[1][j] - w * f_x[0][j]) / square * half_chord;
            if (j == 0)
                d_hat += (f[1] * half_chord - (current ? 3.0 : 2.0) * u * hat) / square;
            else if (j == 1)
                d_hat -= (f[0] * half_chord + (current ? 3.0 : 2.0) * w * hat) / square;
            d_hat /= 1.0 - slope;
            f_x[0][j] += a_u * d_hat;
            f_x[1][j] += a_w * d_hat;
            f_x[2][j] += a_q * d_hat;
        }
    }
}

/* Classical Runge-Kutta with inputs linear in time; f holds the rates at the beginning. */
static void advance(double x[5], double f[5], const double *from, const double *to, int columns, double interval,
                    int substeps, const Terms *terms, const Constants *k)
{
    double input[MOST_SLOTS], stage[5], h = interval / substeps;
    for (int s = 0; s < substeps; s++) {
        double total[5] = {0.0};
        for (int n = 0; n < 4; n++) {
            double reach = n == 0 ? 0.0 : n == 3 ? h : 0.5 * h, weight = n == 0 || n == 3 ? h / 6.0 : h / 3.0;
            double fraction = (s + (n == 0 ? 0.0 : n == 3 ? 1.0 : 0.5)) / substeps;
            if (n > 0 || s > 0) {
                for (int j = 0; j < columns; j++)
                    input[j] = (1.0 - fraction) * from[j] + fraction * to[j];
                for (int i = 0; i < 5; i++)
                    stage[i] = x[i] + reach * f[i];
                evaluate(stage, input, columns, terms, k, f, NULL, false);
            }
            for (int i = 0; i < 5; i++)
                total[i] += weight * f[i];
        }
        for (int i = 0; i < 5; i++)
            x[i] += total[i];
    }
}

static bool inside(const double x[5])
{
    return fabs(atan2(x[1], x[0])) < ALPHA_LIMIT;
}

/* Right-hand sides aug[.][N..width) replaced by their solutions; false where the system is singular. */
static inline bool solve(int width, double aug[N][width])
{
    for (int k = 0; k < N; k++) {
        int pivot = k;
        for (int i = k + 1; i < N; i++)
            if (fabs(aug[i][k]) > fabs(aug[pivot][k]))
                pivot = i;
        if (!(fabs(aug[pivot][k]) > 0.0))
            return false;
        if (pivot != k)
            for (int j = k; j < width; j++) {
                double swap = aug[k][j];
                aug[k][j] = aug[pivot][j];
                aug[pivot][j] = swap;
            }
        double inverse = 1.0 / aug[k][k];
        for (int i = k + 1; i < N; i++) {
            double factor = aug[i][k] * inverse;
            for (int j = k + 1; j < width; j++)
                aug[i][j] -= factor * aug[k][j];
        }
    }
    for (int k = N - 1; k >= 0; k--) {
        double inverse = 1.0 / aug[k][k];
        for (int j = N; j < width; j++)
            aug[k][j] *= inverse;
        for (int i = 0; i < k; i++)
            for (int j = N; j < width; j++)
                aug[i][j] -= aug[i][k] * aug[k][j];
    }
    return true;
}

static void cholesky(const double S[N][N], double L[N][N])
{
    memset(L, 0, sizeof(double[N][N]));
    for (int j = 0; j < N; j++) {
        double pivot = S[j][j], least = N * EPSILON * S[j][j];
        for (int k = 0; k < j; k++)
            pivot -= L[j][k] * L[j][k];
        if (pivot < least || !(pivot > 0.0))
            pivot = least;
        if (pivot <= 0.0)
            continue;
        L[j][j] = sqrt(pivot);
        for (int i = j + 1; i < N; i++) {
            double value = S[i][j];
            for (int k = 0; k < j; k++)
                value -= L[i][k] * L[j][k];
            L[i][j] = value / L[j][j];
        }
    }
}

static inline void symmetrise(int width, double A[N][width], int first)
{
    for (int i = 0; i < N; i++)
        for (int j = 0; j < i; j++)
            A[i][first + j] = A[j][first + i] = 0.5 * (A[i][first + j] + A[j][first + i]);
}

static double balance(const double F[N][N], const double W[N][N], const double C[N][N], double scale[N])
{
    for (int i = 0; i < N; i++)
        scale[i] = W[i][i] > 0.0 && C[i][i] > 0.0 ? sqrt(sqrt(W[i][i] / C[i][i])) : 1.0;
    for (int sweep = 0; sweep < 3; sweep++)
        for (int i = 0; i < N; i++) {
            double into = sqrt(fabs(W[i][i])), out = sqrt(fabs(C[i][i]));
            for (int j = 0; j < N; j++)
                if (j != i) {
                    into += fabs(F[i][j]) * scale[j] + fabs(W[i][j]) / scale[j];
                    out += fabs(F[j][i]) / scale[j] + fabs(C[i][j]) * scale[j];
                }
            if (into > 0.0 && out > 0.0)
                scale[i] = sqrt(into / out);
        }
    double norm = 0.0;
    for (int i = 0; i < N; i++) {
        double upper = 0.0, lower = 0.0;
        for (int j = 0; j < N; j++) {
            upper += fabs(F[i][j]) * scale[j] / scale[i] + fabs(W[i][j]) / (scale[i] * scale[j]);
            lower += fabs(F[j][i]) * scale[i] / scale[j] + fabs(C[i][j]) * scale[i] * scale[j];
        }
        norm = fmax(norm, fmax(upper, lower));
    }
    return norm;
}

static inline void multiply(const double A[H][H + K], const double B[H][H + K], double out[H][H + K])
{
    for (int i = 0; i < H; i++) {
        double row[H + K] = {0.0};
        for (int m = 0; m < H; m++)
            for (int j = 0; j < H + K; j++)
                row[j] += A[i][m] * B[m][j];
        memcpy(out[i], row, sizeof row);
    }
}

/* Three terms of the series added; columns of ramps are one factorial further. */
static inline void add_terms(int c, const double W0[H][H + K], const double W1[H][H + K], const double W2[H][H + K],
                             double out[H][H + K])
{
    double factorial = 1.0;
    for (int i = 2; i < c + 2; i++)
        factorial *= i;
    double f0 = 1.0 / factorial, f1 = f0 / (c + 2), f2 = f1 / (c + 3), f3 = f2 / (c + 4);
    for (int i = 0; i < H; i++) {
        for (int j = 0; j < H + CONSTANT; j++)
            out[i][j] += f0 * W0[i][j] + f1 * W1[i][j] + f2 * W2[i][j];
        for (int j = H + CONSTANT; j < H + K; j++)
            out[i][j] += f1 * W0[i][j] + f2 * W1[i][j] + f3 * W2[i][j];
    }
}

/* The map of a short step of which Hamiltonian | forcing | forcing of the ramps, times its length, stand in W0. */
static bool short_step(const double W0[H][H + K], Map *map)
{
    double W1[H][H + K], W2[H][H + K], T[H][H + K] = {{0.0}}, M[H][H + K], aug[N][3 * N + K];
    multiply(W0, W0, W1);
    multiply(W0, W1, W2);
    add_terms(6, W0, W1, W2, T);
    multiply(W2, T, M);
    add_terms(3, W0, W1, W2, M);
    multiply(W2, M, T);
    add_terms(0, W0, W1, W2, T);
    for (int i = 0; i < N; i++) {
        for (int j = 0; j < N; j++) {
            aug[i][j] = T[N + i][N + j] + (i == j ? 1.0 : 0.0);
            aug[i][N + j] = -T[N + i][N + j];
            aug[i][H + K + j] = T[N + i][j];
        }
        for (int j = 0; j < K; j++)
            aug[i][H + j] = T[N + i][H + j];
    }
    if (!solve(3 * N + K, aug))
        return false;
    for (int i = 0; i < N; i++) {
        for (int j = 0; j < N + K; j++) {
            double value = T[i][N + j], sign = j < N ? 1.0 : -1.0;
            for (int m = 0; m < N; m++)
                value += sign * T[i][N + m] * aug[m][N + j];
            map->ahead[i][j] = value;
            map->back[i][j] = aug[i][H + j];
        }
        for (int j = 0; j < N; j++)
            map->ahead[i][N + K + j] = aug[j][N + i];
    }
    symmetrise(H + K, map->ahead, 0);
    symmetrise(N + K, map->back, K);
    return true;
}

/* The step followed by itself; ramps rise over both together. */
static bool double_step(Map *map)
{
    double (*ahead)[H + K] = map->ahead, (*back)[N + K] = map->back;
    double left[N][H + K], aug[N][3 * N + K], middle[N][N + K], next[N][H + K];
    for (int i = 0; i < N; i++) {
        for (int j = 0; j < N; j++) {
            left[i][j] = back[i][K + j];
            left[i][N + j] = ahead[j][N + K + i] + (i == j ? 1.0 : 0.0);
        }
        for (int j = 0; j < CONSTANT; j++)
            left[i][H + j] = -back[i][j];
        for (int j = CONSTANT; j < K; j++) {
            back[i][j] *= 0.5;
            left[i][H + j] = -0.5 * back[i][j - CONSTANT] - back[i][j];
        }
    }
    for (int i = 0; i < N; i++) {
        double row[H + K] = {0.0}, last[N];
        for (int m = 0; m < N; m++)
            for (int j = 0; j < H + K; j++)
                row[j] += ahead[i][m] * left[m][j];
        for (int j = 0; j < N; j++)
            last[j] = row[j];
        for (int m = 0; m < N; m++)
            for (int j = 0; j < N; j++)
                last[j] += row[m] * ahead[m][N + K + j];
        row[i] += 1.0;
        for (int j = 0; j < CONSTANT; j++)
            row[H + j] += ahead[i][N + j];
        for (int j = CONSTANT; j < K; j++)
            row[H + j] += 0.5 * ahead[i][N + j];
        memcpy(aug[i], row, sizeof row);
        memcpy(aug[i] + H + K, last, sizeof last);
    }
    for (int i = 0; i < N; i++)
        for (int j = CONSTANT; j < K; j++)
            ahead[i][N + j] = 0.5 * (ahead[i][N + j] + ahead[i][N + j - CONSTANT]);
    if (!solve(3 * N + K, aug))
        return false;
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            aug[i][H + K + j] = ahead[i][N + K + j] - aug[i][H + K + j];
    for (int i = 0; i < N; i++) {
        double row[N + K];
        for (int j = 0; j < K; j++)
            row[j] = -left[i][H + j];
        for (int j = 0; j < N; j++)
            row[K + j] = left[i][j];
        for (int m = 0; m < N; m++)
            for (int j = 0; j < N + K; j++)
                row[j] += left[i][m] * aug[m][H + j];
        memcpy(middle[i], row, sizeof row);
    }
    for (int i = 0; i < N; i++) {
        for (int m = 0; m < N; m++)
            for (int j = 0; j < N + K; j++)
                back[i][j] += left[i][N + m] * middle[m][j];
        memcpy(next[i], ahead[i], sizeof next[i]);
        for (int m = 0; m < N; m++)
            for (int j = 0; j < H + K; j++)
                next[i][j] += left[m][N + i] * aug[m][N + j];
    }
    memcpy(ahead, next, sizeof next);
    symmetrise(H + K, ahead, 0);
    symmetrise(N + K, back, K);
    return true;
}

/* S and the correction e of the mean at the end of a step with frozen F, W and C, residuals linear in time. */
static bool estimator_step(double S[N][N], const double F[N][N], const double W[N][N], const double C[N][N],
                           const double g0[N], const double g1[N], double dt, double e[N])
{
    Map map;
    double A[H][H + K], *s = map.scale, norm = balance(F, W, C, s) * dt;
    if (!(norm < INFINITY))
        return false;
    int doublings = 0;
    while (norm > SHORT_STEP_NORM && doublings < MOST_DOUBLINGS) {
        norm *= 0.5;
        dt *= 0.5;
        doublings++;
    }
    for (int i = 0; i < N; i++) {
        double down = dt / s[i], up = dt * s[i];
        for (int j = 0; j < N; j++) {
            A[i][j] = F[i][j] * down * s[j];
            A[N + i][N + j] = -F[j][i] * up / s[j];
            A[i][N + j] = W[i][j] * down / s[j];
            A[N + i][j] = C[i][j] * up * s[j];
        }
        for (int j = 0; j < K; j++) {
            A[i][H + j] = 0.0;
            A[N + i][H + j] = (j % CONSTANT == 0 ? -g0[i] : g0[i] - g1[i]) * up;
        }
    }
    if (!short_step(A, &map))
        return false;
    for (int n = 0; n < doublings; n++)
        if (!double_step(&map))
            return false;

    double L[N][N], GL[N][N], R[N][N], X[N][N + K];
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            R[i][j] = S[i][j] / (s[i] * s[j]);
    cholesky(R, L);
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) {
            GL[i][j] = 0.0;
            for (int m = j; m < N; m++)
                GL[i][j] += map.back[i][K + m] * L[m][j];
        }
    for (int i = 0; i < N; i++)
        for (int j = 0; j <= i; j++) {
            double value = i == j ? 1.0 : 0.0;
            for (int m = i; m < N; m++)
                value += L[m][i] * GL[m][j];
            R[i][j] = R[j][i] = value;
        }
    double root[N][N];
    cholesky(R, root);
    for (int i = 0; i < N; i++) {
        for (int j = 0; j < N + K; j++)
            X[i][j] = j < N ? L[j][i] : 0.0;
        for (int m = i; m < N; m++) {
            for (int j = 0; j < N; j++)
                X[i][j] += L[m][i] * map.ahead[j][N + K + m];
            for (int j = 0; j < K; j++)
                X[i][N + j] -= L[m][i] * map.back[m][j];
        }
        for (int m = 0; m < i; m++)
            for (int j = 0; j < N + K; j++)
                X[i][j] -= root[i][m] * X[m][j];
        double inverse = 1.0 / root[i][i];
        for (int j = 0; j < N + K; j++)
            X[i][j] *= inverse;
    }
    bool finite = true;
    for (int i = 0; i < N; i++) {
        for (int j = 0; j <= i; j++) {
            double value = map.ahead[i][j];
            for (int m = 0; m < N; m++)
                value += X[m][i] * X[m][j];
            S[i][j] = S[j][i] = value * s[i] * s[j];
        }
        finite = finite && S[i][i] < INFINITY;
        e[i] = map.ahead[i][N] + map.ahead[i][N + K - 1];
        for (int m = 0; m < N; m++)
            e[i] += X[m][i] * (X[m][N] + X[m][N + K - 1]);
        e[i] *= s[i];
    }
    return finite;
}

/* 2 H' Q1 and, H being the identity, 2 H' Q1 H too; rows and columns of missing channels are zero. */
static void information(const double *weights, double dt, const double held[N], double HQ[N][N])
{
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++)
            HQ[i][j] = held[i] > 0.0 && held[j] > 0.0
                ? 2.0 * weights[i * N + j] / dt * sqrt(held[i] * held[j]) : 0.0;
}

/* The recursion over a record; returns the number of samples that it reached.
 *
 * time (samples); inputs (samples, columns); measured (samples, 4) u, w, q, theta, NaN where missing; weights
 * (samples, 4, 4) R^-1; density (4) diagonal of Q2^-1; state (5) and riccati_start (4, 4) at the first sample.
 * Out: states (samples, 4), d (samples, 4), riccati (samples, 4, 4).
 */
int64_t run_recursion(int64_t samples, int64_t columns, int64_t substeps, const double *time, const double *inputs,
                      const double *measured, const double *weights, const double *density, const double *state,
                      const double *riccati_start, const double *constants, int64_t terms_count,
                      const int64_t *coefficient, const int64_t *first, const int64_t *variable, const int64_t *shape,
                      const int64_t *power, const double *offset, const double *values, double *states, double *d,
                      double *riccati)
{
    Terms terms = {terms_count, coefficient, first, variable, shape, power, offset, values, false};
    Constants k;
    double x[5], f[5], F[N][N], S[N][N], W[N][N] = {{0.0}};
    if (FIXED + columns > MOST_SLOTS)
        return -1;
    memcpy(&k, constants, sizeof k);
    memcpy(x, state, sizeof x);
    memcpy(S, riccati_start, sizeof S);
    for (int64_t i = 0; i < first[terms_count]; i++)
        terms.alpha_dot_used = terms.alpha_dot_used || variable[i] == 3;
    for (int i = 0; i < N; i++)
        W[i][i] = 0.5 * density[i];
    for (int64_t n = 0; n < samples; n++) {
        const double *input = inputs + n * columns, *now = measured + n * N, *weight = weights + n * N * N;
        double r0[N], r1[N], here[N], mean[N], HQ[N][N], g0[N], g1[N], e[N];
        if (!inside(x))
            return n;
        evaluate(x, input, (int)columns, &terms, &k, f, F, true);
        int64_t next = n + 1 < samples ? n + 1 : n;
        double dt = time[next] - time[next - 1];
        bool seen = false;
        for (int i = 0; i < N; i++) {
            states[n * N + i] = x[i];
            r0[i] = now[i] - x[i];
            here[i] = isnan(r0[i]) ? 0.0 : 1.0;
            seen = seen || here[i] > 0.0;
        }
        memcpy(riccati + n * N * N, S, sizeof S);
        information(weight, dt, here, HQ);
        for (int i = 0; i < N; i++) {
            g0[i] = 0.0;
            for (int j = 0; j < N; j++)
                g0[i] += here[j] > 0.0 ? HQ[i][j] * r0[j] : 0.0;
        }
        for (int i = 0; i < N; i++) {
            double value = 0.0;
            for (int j = 0; j < N; j++)
                value += S[i][j] * g0[j];
            d[n * N + i] = seen ? value : NAN;
        }
        if (n + 1 == samples)
            break;
        advance(x, f, input, input + columns, (int)columns, dt, (int)substeps, &terms, &k);
        if (!inside(x))
            return n + 1;
        for (int i = 0; i < N; i++) {
            r1[i] = now[N + i] - x[i];
            double there = isnan(r1[i]) ? 0.0 : 1.0;
            mean[i] = 0.5 * (here[i] + there);
            if (here[i] == 0.0)
                r0[i] = there > 0.0 ? r1[i] : 0.0;
            if (there == 0.0)
                r1[i] = r0[i];
        }
        information(weight, dt, mean, HQ);
        for (int i = 0; i < N; i++) {
            g0[i] = g1[i] = 0.0;
            for (int j = 0; j < N; j++) {
                g0[i] += HQ[i][j] * r0[j];
                g1[i] += HQ[i][j] * r1[j];
            }
        }
        if (!estimator_step(S, F, W, HQ, g0, g1, dt, e))
            return n + 1;
        for (int i = 0; i < N; i++)
            x[i] += e[i];
    }
    return samples;
}
