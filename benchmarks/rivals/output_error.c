/* Output error in plain C: the limit for methods that simulate the whole flight.
 *
 * The same equations, integration and weights as equations.py and output_error.py; Gauss-Newton with forward
 * differences, normal equations summed as the flights go, Cholesky, steps halved until the cost falls.
 */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { STATES = 5, OUTPUTS = 7, ROWS = 3, COLUMNS = 10, TABLE = ROWS * COLUMNS, MOST = TABLE + STATES };

static const double GRAVITY = 9.80665;

typedef struct {
    double mass, I_yy, wing_area, mean_chord, reference_speed, density, thrust;
} Body;

static void forces(const double *x, double elevator, const double *table, const Body *b, double out[3])
{
    double square = x[0] * x[0] + x[1] * x[1], alpha = atan2(x[1], x[0]);
    double q_hat = x[2] * b->mean_chord / (2.0 * b->reference_speed), force = 0.5 * b->density * square * b->wing_area;
    double terms[COLUMNS] = {1.0, alpha, q_hat, elevator, alpha * alpha, alpha * q_hat, alpha * elevator,
                             q_hat * q_hat, q_hat * elevator, elevator * elevator};
    double c[ROWS] = {0.0, 0.0, 0.0};
    for (int row = 0; row < ROWS; row++)
        for (int column = 0; column < COLUMNS; column++)
            c[row] += table[row * COLUMNS + column] * terms[column];
    out[0] = (force * c[0] + b->thrust) / b->mass;
    out[1] = force * c[1] / b->mass;
    out[2] = force * b->mean_chord * c[2] / b->I_yy;
}

static void rates(const double *x, double elevator, const double *table, const Body *b, double out[STATES])
{
    double f[3], sine = sin(x[3]), cosine = cos(x[3]);
    forces(x, elevator, table, b, f);
    out[0] = f[0] - GRAVITY * sine - x[2] * x[1];
    out[1] = f[1] + GRAVITY * cosine + x[2] * x[0];
    out[2] = f[2];
    out[3] = x[2];
    out[4] = x[0] * sine - x[1] * cosine;
}

static void moved(const double *x, const double *k, double share, double out[STATES])
{
    for (int i = 0; i < STATES; i++)
        out[i] = x[i] + share * k[i];
}

static void simulate(int64_t samples, const double *time, const double *elevator, const double *table,
                     const double *start, const Body *b, double *outputs)
{
    double x[STATES], y[STATES], k1[STATES], k2[STATES], k3[STATES], k4[STATES], f[3];
    memcpy(x, start, sizeof x);
    for (int64_t n = 0; n < samples; n++) {
        double *out = outputs + n * OUTPUTS;
        forces(x, elevator[n], table, b, f);
        out[0] = hypot(x[0], x[1]);
        out[1] = atan2(x[1], x[0]);
        out[2] = x[2];
        out[3] = x[3];
        out[4] = f[0];
        out[5] = f[1];
        out[6] = x[4];
        if (n + 1 == samples)
            return;
        double dt = time[n + 1] - time[n], middle = 0.5 * (elevator[n] + elevator[n + 1]);
        rates(x, elevator[n], table, b, k1);
        moved(x, k1, 0.5 * dt, y);
        rates(y, middle, table, b, k2);
        moved(x, k2, 0.5 * dt, y);
        rates(y, middle, table, b, k3);
        moved(x, k3, dt, y);
        rates(y, elevator[n + 1], table, b, k4);
        for (int i = 0; i < STATES; i++)
            x[i] += dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
    }
}

/* Lower Cholesky factor in place; 0 where there is none. */
static int factor(double *a, int n)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            double sum = a[i * n + j];
            for (int k = 0; k < j; k++)
                sum -= a[i * n + k] * a[j * n + k];
            if (i == j && !(sum > 0.0))
                return 0;
            a[i * n + j] = i == j ? sqrt(sum) : sum / a[j * n + j];
        }
    return 1;
}

static void solve(const double *l, int n, double *x)
{
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++)
            x[i] -= l[i * n + k] * x[k];
        x[i] /= l[i * n + i];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++)
            x[i] -= l[k * n + i] * x[k];
        x[i] /= l[i * n + i];
    }
}

static double flown(int64_t samples, const double *time, const double *elevator, const double *measured,
                    const double *weight, const Body *b, int64_t count, const int64_t *places, const double *unknown,
                    double *residuals)
{
    double table[TABLE] = {0.0}, sum = 0.0;
    for (int64_t i = 0; i < count; i++)
        table[places[i]] = unknown[i];
    simulate(samples, time, elevator, table, unknown + count, b, residuals);
    for (int64_t n = 0; n < samples * OUTPUTS; n++) {
        residuals[n] = (residuals[n] - measured[n]) * weight[n % OUTPUTS];
        sum += residuals[n] * residuals[n];
    }
    return sum;
}

/* Estimates `count` numbers of the table at `places`, then the initial state; `unknown` holds the start, then the
 * answer, `deviation` its standard deviations. Returns the number of steps, or -1. */
int64_t fit(int64_t samples, const double *time, const double *elevator, const double *measured, const double *weight,
            const double *body, int64_t count, const int64_t *places, const double *size, double *unknown,
            double *deviation)
{
    Body b;
    memcpy(&b, body, sizeof b);
    int n = (int)count + STATES;
    size_t numbers = (size_t)samples * OUTPUTS;
    double *r = malloc((size_t)(n + 2) * numbers * sizeof(double));
    double normal[MOST * MOST], step[MOST], tried[MOST];
    if (!r)
        return -1;
    double *beside = r + numbers;
    double *columns = r + 2 * numbers;
    double cost = flown(samples, time, elevator, measured, weight, &b, count, places, unknown, r);
    int64_t steps = 0, done = -1;
    for (; steps < 50; steps++) {
        for (int i = 0; i < n; i++) {
            double h = 1e-6 * size[i], *column = columns + (size_t)i * numbers;
            memcpy(tried, unknown, (size_t)n * sizeof(double));
            tried[i] += h;
            flown(samples, time, elevator, measured, weight, &b, count, places, tried, column);
            for (size_t k = 0; k < numbers; k++)
                column[k] = (column[k] - r[k]) * (size[i] / h);
        }
        for (int i = 0; i < n; i++) {
            const double *a = columns + (size_t)i * numbers;
            step[i] = 0.0;
            for (size_t k = 0; k < numbers; k++)
                step[i] -= a[k] * r[k];
            for (int j = 0; j <= i; j++) {
                const double *c = columns + (size_t)j * numbers;
                double sum = 0.0;
                for (size_t k = 0; k < numbers; k++)
                    sum += a[k] * c[k];
                normal[i * n + j] = normal[j * n + i] = sum;
            }
        }
        if (!factor(normal, n))
            break;
        solve(normal, n, step);
        double share = 1.0, found = 0.0;
        for (int halved = 0; halved < 20; halved++, share *= 0.5) {
            for (int i = 0; i < n; i++)
                tried[i] = unknown[i] + share * size[i] * step[i];
            found = flown(samples, time, elevator, measured, weight, &b, count, places, tried, beside);
            if (found <= cost)
                break;
        }
        double gained = cost - found;
        if (gained > 0.0) {
            memcpy(unknown, tried, (size_t)n * sizeof(double));
            memcpy(r, beside, numbers * sizeof(double));
            cost = found;
        }
        if (!(gained > 1e-8 * cost)) {
            done = steps + 1;
            break;
        }
    }
    for (int i = 0; done > 0 && i < n; i++) {
        double unit[MOST] = {0.0};
        unit[i] = 1.0;
        solve(normal, n, unit);
        deviation[i] = size[i] * sqrt(unit[i] * cost / (double)(numbers - (size_t)n));
    }
    free(r);
    return done;
}
