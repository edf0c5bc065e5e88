// Force elements of a rig as MuJoCo's passive force, and a time loop without Python: helper of mujoco.py.
#include <math.h>
#include <mujoco/mujoco.h>
#include <string.h>

// One row of the table, all doubles. Bodies are MuJoCo's; vectors are in their axes.
enum { KIND, LAW, BODY_A, BODY_B, BODY_N, DOF, POINT_A, POINT_B = 9, AXIS = 12, PARAMETERS = 15, TERMS = 24, SERIES, WIDTH = 64 };
enum { JOINT, TURN, LINE, SLIDE };
enum { OIL, SPRING, CONTACT, HARMONIC };
enum { MAX_FORCES = 32, MAX_BODIES = 32 };

static double table[MAX_FORCES][WIDTH];
static int count;

static void place(const mjData* d, int body, const double* local, int is_point, double out[3]) {
  const double *R = d->xmat + 9 * body, *p = d->xpos + 3 * body;
  for (int i = 0; i < 3; ++i)
    out[i] = R[3 * i] * local[0] + R[3 * i + 1] * local[1] + R[3 * i + 2] * local[2] + (is_point ? p[i] : 0.0);
}

static void cross(const double a[3], const double b[3], double out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Velocity of a point of a body: cvel is (angular, linear) at the centre of mass of the body's tree.
static void velocity(const mjModel* m, const mjData* d, int body, const double point[3], double out[3]) {
  const double *twist = d->cvel + 6 * body, *centre = d->subtree_com + 3 * m->body_rootid[body];
  const double arm[3] = {point[0] - centre[0], point[1] - centre[1], point[2] - centre[2]};
  cross(twist, arm, out);
  for (int i = 0; i < 3; ++i) out[i] += twist[3 + i];
}

static double law(const double* row, double x, double x_dot, double t) {
  const double* p = row + PARAMETERS;
  switch ((int)row[LAW]) {
    case OIL: {  // x0 E0 S_A S_B l_A l_B p_A0 p_B0 k
      const double u = x - p[0];
      return (p[6] - p[1] * log1p(u / p[4])) * p[2] - (p[7] - p[1] * log1p(-u / p[5])) * p[3] - p[8] * x_dot;
    }
    case SPRING:  // x0 F0 c k
      return p[1] - p[2] * (x - p[0]) - p[3] * x_dot;
    case CONTACT:  // x0 N0 c k
      return -(p[1] + p[2] * (x - p[0]) + p[3] * x_dot);
    default: {  // mean ramp
      double sum = p[0];
      const double* term = row + SERIES;
      for (int i = 0; i < (int)row[TERMS]; ++i, term += 3) sum += term[0] * sin(6.283185307179586 * t * term[1] + term[2]);
      if (t >= p[1]) return sum;
      const double s = t / p[1];
      return s * s * s * (10.0 + s * (6.0 * s - 15.0)) * sum;
    }
  }
}

// Wrenches (force, moment about the world origin) are gathered by body, summed towards the root and met by each joint.
static void passive(const mjModel* m, mjData* d) {
  double wrench[MAX_BODIES][6];
  memset(wrench, 0, sizeof wrench[0] * m->nbody);
  for (int i = 0; i < count; ++i) {
    const double* row = table[i];
    const int kind = (int)row[KIND], a = (int)row[BODY_A], b = (int)row[BODY_B], dof = (int)row[DOF];
    if (kind == JOINT) {
      d->qfrc_passive[dof] += law(row, d->qpos[dof], d->qvel[dof], d->time);
      continue;
    }
    double n[3], w[6] = {0};
    if (kind != LINE) place(d, (int)row[BODY_N], row + AXIS, 0, n);
    if (kind == TURN) {
      const double M = law(row, 0.0, 0.0, d->time);
      for (int k = 0; k < 3; ++k) w[3 + k] = M * n[k];
    } else {
      double A[3], B[3], v_a[3], v_b[3], span[3];
      place(d, a, row + POINT_A, 1, A);
      place(d, b, row + POINT_B, 1, B);
      velocity(m, d, a, A, v_a);
      velocity(m, d, b, B, v_b);
      for (int k = 0; k < 3; ++k) span[k] = B[k] - A[k], v_b[k] -= v_a[k];
      double x;
      if (kind == LINE) {
        x = sqrt(dot(span, span));
        for (int k = 0; k < 3; ++k) n[k] = span[k] / x;
      } else {
        x = dot(n, span);
      }
      const double F = law(row, x, dot(n, v_b), d->time);
      for (int k = 0; k < 3; ++k) w[k] = F * n[k];
      cross(B, w, w + 3);
    }
    for (int k = 0; k < 6; ++k) wrench[b][k] += w[k], wrench[a][k] -= w[k];
  }
  for (int body = m->nbody - 1; body > 0; --body) {
    const double* w = wrench[body];
    const int joint = m->body_jntadr[body];
    if (joint >= 0) {
      const double* axis = d->xaxis + 3 * joint;
      double* tau = d->qfrc_passive + m->jnt_dofadr[joint];
      if (m->jnt_type[joint] == mjJNT_SLIDE) {
        *tau += dot(axis, w);
      } else {
        double moment[3];
        cross(d->xanchor + 3 * joint, w, moment);
        *tau += dot(axis, w + 3) - dot(axis, moment);
      }
    }
    for (int k = 0; k < 6; ++k) wrench[m->body_parentid[body]][k] += w[k];
  }
}

void install(const double* rows, int n) {
  count = n < MAX_FORCES ? n : MAX_FORCES;
  memcpy(table, rows, sizeof(double) * WIDTH * count);
  mjcb_passive = passive;
}

void uninstall(void) { mjcb_passive = 0; }

// `steps` steps; positions after every `every`-th into `out`.
void drive(const mjModel* m, mjData* d, int steps, int every, double* out) {
  for (int i = 1; i <= steps; ++i) {
    mj_step(m, d);
    if (i % every == 0) {
      memcpy(out, d->qpos, sizeof(double) * m->nq);
      out += m->nq;
    }
  }
}
