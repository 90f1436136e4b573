/* Circuit around an emulated board: sheets, switches, pins, shunt and cables as one linear network in time.

   Nodes: the electrodes A, B, C, D and the rail behind the shunt. With the conductances G, the capacitances K and the
   sources s, K dV/dt = s - G V. Between two switchings G is constant, and V is known in closed form from the
   eigenvectors of K^-1/2 G K^-1/2, so a reading has no error of integration. */
#ifndef BOARD_CIRCUIT_H
#define BOARD_CIRCUIT_H

#include <math.h>
#include <string.h>

enum { NODES = 5, RAIL_NODE = 4 };
enum { PIN_FREE, PIN_PULLED_UP, PIN_LOW, PIN_HIGH };

typedef struct {
  double supply;                       /* potential of the source before the shunt [V] */
  double shunt, leads, pin, switches;  /* shunt, lead of an electrode, a pin of a pull-down, an analog switch [ohm] */
  double pulldown, input, pullup;      /* resistors of the touch phase, of each input, of a controller's pin [ohm] */
  double logic;                        /* potential of a high pin [V] */
  double cable, layers, rail;          /* capacitance of an electrode's wires, between the layers, of the rail [F] */
  double sheets[4][4];                 /* admittances of the sheets with their contacts [S] */
  int closed[4], ground[4], down[2];   /* switches to the rail, and to ground; state of the pull-downs' pins */
  /* the rest is worked out */
  double now, since;                   /* time, and when this state began [s] */
  double settled[NODES], amplitude[NODES], rate[NODES], shape[NODES][NODES];
  int changed;
} Circuit;

static void pin_load(const Circuit *c, int state, double ohms, double *conductance, double *source) {
  if (state == PIN_FREE) return;
  const double g = 1.0 / (ohms + (state == PIN_PULLED_UP ? c->pullup : c->pin));
  *conductance += g;
  if (state != PIN_LOW) *source += g * c->logic;
}

/* Solve a x = b for a symmetric, positive definite matrix, which is overwritten. */
static void solve_spd(double a[NODES][NODES], double *b) {
  for (int k = 0; k < NODES; k++)
    for (int i = k + 1; i < NODES; i++) {
      const double f = a[i][k] / a[k][k];
      for (int j = k; j < NODES; j++) a[i][j] -= f * a[k][j];
      b[i] -= f * b[k];
    }
  for (int k = NODES - 1; k >= 0; k--) {
    for (int j = k + 1; j < NODES; j++) b[k] -= a[k][j] * b[j];
    b[k] /= a[k][k];
  }
}

/* Diagonalise a symmetric matrix by Jacobi rotations: a becomes diagonal, the columns of v its eigenvectors. */
static void diagonalise(double a[NODES][NODES], double v[NODES][NODES]) {
  for (int i = 0; i < NODES; i++)
    for (int j = 0; j < NODES; j++) v[i][j] = i == j;
  for (int sweep = 0; sweep < 30; sweep++) {
    double off = 0.0, all = 0.0;
    for (int i = 0; i < NODES; i++)
      for (int j = 0; j < NODES; j++) {
        all += a[i][j] * a[i][j];
        if (i != j) off += a[i][j] * a[i][j];
      }
    if (off <= 1e-28 * all) return;
    for (int p = 0; p < NODES; p++)
      for (int q = p + 1; q < NODES; q++) {
        if (a[p][q] == 0.0) continue;
        const double theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
        const double t = (theta < 0 ? -1.0 : 1.0) / (fabs(theta) + sqrt(theta * theta + 1.0));
        const double cosine = 1.0 / sqrt(t * t + 1.0), sine = t * cosine;
        for (int k = 0; k < NODES; k++) {
          const double x = a[k][p], y = a[k][q];
          a[k][p] = cosine * x - sine * y;
          a[k][q] = sine * x + cosine * y;
        }
        for (int k = 0; k < NODES; k++) {
          const double x = a[p][k], y = a[q][k];
          a[p][k] = cosine * x - sine * y;
          a[q][k] = sine * x + cosine * y;
        }
        for (int k = 0; k < NODES; k++) {
          const double x = v[k][p], y = v[k][q];
          v[k][p] = cosine * x - sine * y;
          v[k][q] = sine * x + cosine * y;
        }
      }
  }
}

static void potentials(const Circuit *c, double *volts) {
  for (int i = 0; i < NODES; i++) volts[i] = c->settled[i];
  for (int m = 0; m < NODES; m++) {
    const double left = c->amplitude[m] * exp(-c->rate[m] * (c->now - c->since));
    for (int i = 0; i < NODES; i++) volts[i] += c->shape[i][m] * left;
  }
}

/* Begin a new state now: the potentials go on from where they are. */
static void rewire(Circuit *c) {
  double volts[NODES], g[NODES][NODES] = {{0}}, k[NODES][NODES] = {{0}}, s[NODES] = {0};
  potentials(c, volts);
  for (int i = 0; i < 4; i++) {
    for (int j = 0; j < 4; j++) g[i][j] = c->sheets[i][j];
    g[i][i] += 1.0 / c->input;
    if (c->ground[i]) g[i][i] += 1.0 / (c->switches + c->leads);
    if (i >= 2) pin_load(c, c->down[i - 2], c->leads + c->pulldown, &g[i][i], &s[i]);
    if (c->closed[i]) {
      const double y = 1.0 / (c->switches + c->leads);
      g[i][i] += y;
      g[RAIL_NODE][RAIL_NODE] += y;
      g[i][RAIL_NODE] -= y;
      g[RAIL_NODE][i] -= y;
    }
    k[i][i] = c->cable + 0.5 * c->layers;
    for (int j = 2; i < 2 && j < 4; j++) k[i][j] = k[j][i] = -0.25 * c->layers;
  }
  g[RAIL_NODE][RAIL_NODE] += 1.0 / c->shunt;
  s[RAIL_NODE] = c->supply / c->shunt;
  k[RAIL_NODE][RAIL_NODE] = c->rail;

  static double root[NODES][NODES], inverse[NODES][NODES]; /* K^1/2 and K^-1/2: they stay as they are */
  double vectors[NODES][NODES];
  if (root[0][0] == 0.0) diagonalise(k, vectors);
  for (int i = 0; root[NODES - 1][NODES - 1] == 0.0 && i < NODES; i++)
    for (int j = 0; j < NODES; j++) {
      root[i][j] = inverse[i][j] = 0.0;
      for (int m = 0; m < NODES; m++) {
        root[i][j] += vectors[i][m] * sqrt(k[m][m]) * vectors[j][m];
        inverse[i][j] += vectors[i][m] / sqrt(k[m][m]) * vectors[j][m];
      }
    }
  double half[NODES][NODES], a[NODES][NODES];
  for (int i = 0; i < NODES; i++)
    for (int j = 0; j < NODES; j++) {
      half[i][j] = 0.0;
      for (int m = 0; m < NODES; m++) half[i][j] += g[i][m] * inverse[m][j];
    }
  for (int i = 0; i < NODES; i++)
    for (int j = 0; j < NODES; j++) {
      a[i][j] = 0.0;
      for (int m = 0; m < NODES; m++) a[i][j] += inverse[i][m] * half[m][j];
    }
  diagonalise(a, vectors);
  solve_spd(g, s);
  for (int m = 0; m < NODES; m++) {
    c->settled[m] = s[m];
    c->rate[m] = a[m][m];
    c->amplitude[m] = 0.0;
  }
  for (int m = 0; m < NODES; m++)
    for (int i = 0; i < NODES; i++) {
      c->shape[i][m] = 0.0;
      for (int j = 0; j < NODES; j++) {
        c->shape[i][m] += inverse[i][j] * vectors[j][m];
        c->amplitude[m] += vectors[i][m] * root[i][j] * (volts[j] - c->settled[j]);
      }
    }
  c->since = c->now;
  c->changed = 0;
}

static void advance(Circuit *c, double now) {
  if (c->changed && now > c->now) rewire(c);
  c->now = now;
}

#endif
