#include "dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "dense.hpp"

namespace drillrig {

using Eigen::Map;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

// Joint placement as Pinocchio keeps it: world axes x, y, z and origin, twelve numbers in a row.
inline Vector3d world(const double* frames, const Anchor& anchor) {
  const double* f = frames + 12 * anchor.joint;
  const double x = anchor.vector[0], y = anchor.vector[1], z = anchor.vector[2], w = anchor.w;
  return {f[0] * x + f[3] * y + f[6] * z + f[9] * w, f[1] * x + f[4] * y + f[7] * z + f[10] * w,
          f[2] * x + f[5] * y + f[8] * z + f[11] * w};
}

}  // namespace

Dynamics::Dynamics(const RigSpec& spec, const LawCallback& callback)
    : nq(spec.tree->nq()),
      nv(spec.tree->nv()),
      spec_(spec),
      context_{&spec.series, callback},
      tree_(*spec.tree),
      n_(spec.coordinates.size()),
      m_(spec.constraints),
      joints_(spec.tree->njoints()),
      simple_(spec.tree->simple()) {
  const int others = spec.coordinates.others();
  x = x_dot = VectorXd::Zero(n_);
  F = VectorXd::Zero(n_ - m_);
  f = f_dot = lambda = gamma = tmp_m_ = p2_ = VectorXd::Zero(m_);
  a = p1_ = tmp_v_ = zero_v_ = step_ = right_ = VectorXd::Zero(nv);
  W_.assign(others, Wrench::Zero());
  V_.assign(joints_, Wrench::Zero());
  applied_.assign(joints_, Wrench::Zero());
  end_.assign(others, Vector3d::Zero());
  axis_.assign(others, Vector3d::Zero());
  base_axis_.assign(others, Vector3d::Zero());
  L_.assign(nv * nv, 0.0);
  Z_.assign(m_ * nv, 0.0);
  J_.assign(m_ * nv, 0.0);
  small_.assign(m_ * m_, 0.0);
  L_small_.assign(m_ * m_, 0.0);
  vectors_.assign(m_ * m_, 0.0);
  S_.setZero(m_, m_);
  looked_at_.setZero(m_, m_);
  K_.setZero(nv, nv);
  Q_.setZero(nv, nv);
  M_full_.setZero(nv, nv);
  Jt_.setZero(nv, m_);
  if (m_ > 0) {
    qr_ = Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(nv, m_);
  }
  lu_ = Eigen::PartialPivLU<Eigen::MatrixXd>(nv);
  for (int i = 0; i < n_ - m_; ++i)
    if (spec.laws[i].load && depends_on_time_alone(spec.laws[i])) known_.push_back(i);
  known_now_.assign(known_.size(), 0.0);
  for (const Law& law : spec.laws) switches_ += drillrig::switch_count(law);
}

void Dynamics::place(const double* q) {
  const Coordinates& c = spec_.coordinates;
  const double* frames = tree_.frames();
  const int nj = static_cast<int>(c.joints.size());
  for (int i = 0; i < nj; ++i) x[i] = q[c.joints[i].index_q];
  int k = 0;
  for (const int end = c.turns; k < end; ++k) {
    axis_[k] = world(frames, c.a[k]);
    W_[k].tail<3>() = axis_[k];
  }
  for (const int end = k + c.lines; k < end; ++k) {
    end_[k] = world(frames, c.b[k]);
    const Vector3d span = end_[k] - world(frames, c.a[k]);
    const double length = span.norm();
    x[nj + k] = length;
    axis_[k] = span / length;
    W_[k].head<3>() = axis_[k];
    W_[k].tail<3>() = end_[k].cross(axis_[k]);
  }
  for (const int end = k + c.slides; k < end; ++k) {
    end_[k] = world(frames, c.b[k]);
    axis_[k] = world(frames, c.c[k]);
    x[nj + k] = axis_[k].dot(end_[k] - world(frames, c.a[k]));
    W_[k].head<3>() = axis_[k];
    W_[k].tail<3>() = end_[k].cross(axis_[k]);
  }
  for (const int end = k + c.angles; k < end; ++k) {
    base_axis_[k] = world(frames, c.a[k]);
    axis_[k] = world(frames, c.b[k]);
    x[nj + k] = base_axis_[k].dot(axis_[k]);
    W_[k].tail<3>() = axis_[k].cross(base_axis_[k]);
  }
  int i = nj + k;
  for (const GearCoordinate& gear : c.gears) x[i++] = q[gear.follower.index_q] - gear.ratio * q[gear.leader.index_q];
}

// V_j = V_parent + J_j v_j: parents come before their children.
void Dynamics::body_velocities(const double* v) {
  const double* J = tree_.J();
  for (int j = 1; j < joints_; ++j) {
    const JointSpan& span = spec_.spans[j];
    Wrench V = V_[span.parent];
    for (int d = span.first; d < span.first + span.count; ++d) V += Map<const Wrench>(J + 6 * d) * v[d];
    V_[j] = V;
  }
}

void Dynamics::coordinate_rates(const double* v) {
  const Coordinates& c = spec_.coordinates;
  const int nj = static_cast<int>(c.joints.size()), others = c.others();
  for (int i = 0; i < nj; ++i) x_dot[i] = v[c.joints[i].index_v];
  for (int i = 0; i < others; ++i) x_dot[nj + i] = W_[i].dot(V_[c.moving[i]] - V_[c.base[i]]);
  int i = nj + others;
  for (const GearCoordinate& gear : c.gears) x_dot[i++] = v[gear.follower.index_v] - gear.ratio * v[gear.leader.index_v];
}

// Each force is a wrench on two bodies; wrenches are summed from the leaves to the root: tau_d = J_d . sum beyond d.
void Dynamics::apply_forces(const double* bias) {
  const Coordinates& c = spec_.coordinates;
  const int nj = static_cast<int>(c.joints.size()), acting = n_ - m_ - nj;
  for (int j = 1; j < joints_; ++j) applied_[j].setZero();
  for (int i = 0; i < acting; ++i) {
    const Wrench w = F[nj + i] * W_[i];
    applied_[c.moving[i]] += w;
    applied_[c.base[i]] -= w;
  }
  const double* J = tree_.J();
  for (int j = joints_ - 1; j > 0; --j) {
    const JointSpan& span = spec_.spans[j];
    for (int d = span.first; d < span.first + span.count; ++d)
      p1_[d] = Map<const Wrench>(J + 6 * d).dot(applied_[j]) - bias[d];
    applied_[span.parent] += applied_[j];
  }
  for (int i = 0; i < nj; ++i) p1_[c.joints[i].index_v] += F[i];
}

void Dynamics::row_of(int wrench, double* out) const {
  const double* J = tree_.J();
  const signed char* sign = spec_.signs.data() + static_cast<std::size_t>(wrench) * nv;
  for (int d = 0; d < nv; ++d) out[d] = sign[d] == 0 ? 0.0 : sign[d] * W_[wrench].dot(Map<const Wrench>(J + 6 * d));
}

void Dynamics::constraint_rows() {
  const Coordinates& c = spec_.coordinates;
  const int with_wrench = m_ - static_cast<int>(c.gears.size()), first = c.others() - with_wrench;
  for (int r = 0; r < with_wrench; ++r) row_of(first + r, J_.data() + r * nv);
  gear_rows(J_.data() + with_wrench * nv);
}

void Dynamics::gear_rows(double* out) const {
  for (const GearCoordinate& gear : spec_.coordinates.gears) {
    std::fill(out, out + nv, 0.0);
    out[gear.follower.index_v] += 1.0;
    out[gear.leader.index_v] -= gear.ratio;
    out += nv;
  }
}

const double* Dynamics::jacobian_at(const double* q) {
  tree_.kinematics(q);
  place(q);
  constraint_rows();
  return J_.data();
}

void Dynamics::gradient_rows(double* out) const {
  const Coordinates& c = spec_.coordinates;
  const int nj = static_cast<int>(c.joints.size());
  std::fill(out, out + n_ * nv, 0.0);
  for (int i = 0; i < nj; ++i) out[i * nv + c.joints[i].index_v] = 1.0;
  for (int i = 0; i < c.others(); ++i) row_of(i, out + (nj + i) * nv);
  gear_rows(out + (nj + c.others()) * nv);
}

// gamma = W . (A_b - A_a) + W_dot . (V_b - V_a), as CoordinateSet.bias in Python.
void Dynamics::constraint_bias() {
  const Coordinates& c = spec_.coordinates;
  const int others = c.others();
  gamma.setZero();  // of gears it is
  for (int i = others - m_ + static_cast<int>(c.gears.size()), r = 0; i < others; ++i, ++r) {
    const int b = c.moving[i], o = c.base[i];
    Wrench A, A_base;
    tree_.drift(b, A.data());
    if (o != 0) {
      tree_.drift(o, A_base.data());
      A -= A_base;
    }
    const Wrench &V_b = V_[b], &V_a = V_[o];
    Wrench W_dot = Wrench::Zero();
    if (i < others - c.angles) {
      const Vector3d &n = axis_[i], &P = end_[i];
      const Vector3d velocity = V_b.head<3>() + V_b.tail<3>().cross(P), n_dot = V_a.tail<3>().cross(n);
      W_dot.head<3>() = n_dot;
      W_dot.tail<3>() = velocity.cross(n) + P.cross(n_dot);
    } else {
      const Vector3d &base = base_axis_[i], &moving = axis_[i];
      W_dot.tail<3>() = V_b.tail<3>().cross(moving).cross(base) + moving.cross(V_a.tail<3>().cross(base));
    }
    gamma[r] = W_[i].dot(A) + W_dot.dot(V_b - V_a);
  }
}

void Dynamics::stabilise() {
  const double* k = spec_.correction_values;
  for (int i = 0; i < m_; ++i) {
    double value = 0.0;
    if (spec_.correction == Correction::baumgarte) {
      value = -(2.0 * k[0]) * f_dot[i] - (k[1] * k[1]) * f[i];
    } else if (spec_.correction == Correction::sliding_mode) {
      value = -k[0] * f_dot[i] - k[1] * std::tanh((f_dot[i] + k[0] * f[i]) / k[2]);
    }
    p2_[i] = value - gamma[i];
  }
}

void Dynamics::know_forces(double t) {
  if (t == known_time_) return;
  for (std::size_t k = 0; k < known_.size(); ++k)
    known_now_[k] = evaluate(spec_.laws[known_[k]], known_[k], context_, 0.0, 0.0, t).force;
  known_time_ = t;
}

void Dynamics::known_forces(double t, double* out) {
  know_forces(t);
  std::copy(known_now_.begin(), known_now_.end(), out);
}

bool Dynamics::known_responses(Eigen::Ref<Eigen::MatrixXd> out) {
  const int nj = static_cast<int>(spec_.coordinates.joints.size());
  p2_.setZero();
  for (std::size_t k = 0; k < known_.size(); ++k) {
    const int i = known_[k];
    p1_.setZero();
    if (i < nj)
      p1_[spec_.coordinates.joints[i].index_v] = 1.0;
    else
      row_of(i - nj, p1_.data());
    if (!solve(p1_.data(), p2_.data())) return false;
    out.col(k) = a;
  }
  return true;
}

Status Dynamics::rate(double t, const double* y, double* dy) {
  if (stopped()) return Status::interrupted;
  const double *q = y, *v = y + nq;
  tree_.dynamics(q, v);
  place(q);
  body_velocities(v);
  coordinate_rates(v);
  const int forces = n_ - m_;
  double supplied = 0.0, lost = 0.0;
  know_forces(t);
  std::size_t next = 0;
  for (int i = 0; i < forces; ++i) {
    if (next < known_.size() && known_[next] == i) {
      F[i] = known_now_[next++];
      supplied += F[i] * x_dot[i];
      continue;
    }
    const LawValue value = evaluate(spec_.laws[i], i, context_, x[i], x_dot[i], t);
    if (!value.ok) return Status::callback_failed;
    F[i] = value.force;
    if (spec_.laws[i].load) {
      supplied += value.force * x_dot[i];
    } else {
      lost += value.dissipation;
    }
  }
  apply_forces(tree_.nle());
  if (m_ > 0) {
    for (int i = 0; i < m_; ++i) {
      f[i] = x[forces + i] - spec_.targets[i];
      f_dot[i] = x_dot[forces + i];
    }
    constraint_rows();
    constraint_bias();
    stabilise();
  }
  if (!solve(p1_.data(), p2_.data())) {
    if (p1_.allFinite() && p2_.allFinite()) return Status::singular;
    // A state outside the domain of a law is no loss of rank: the rate is not a number, and the step is not accepted.
    std::fill(dy, dy + size(), std::numeric_limits<double>::quiet_NaN());
    return Status::completed;
  }
  if (simple_) {
    std::memcpy(dy, v, sizeof(double) * nv);
  } else {
    tree_.rate(q, v, dy);
  }
  std::memcpy(dy + nq, a.data(), sizeof(double) * nv);
  dy[nq + nv] = supplied;
  dy[nq + nv + 1] = lost;
  return Status::completed;
}

Status Dynamics::project(double* y) {
  double *q = y, *v = y + nq;
  if (!simple_) tree_.normalize(q);
  if (m_ == 0) return Status::completed;
  const int forces = n_ - m_;
  // The metric is the mass matrix evaluated last, a step away at most: it only says which of all small changes is made.
  if (!factored_) {
    tree_.dynamics(q, v);
    if (!dense::factor(tree_.M(), nv, L_.data())) return Status::singular;
    factored_ = true;
  } else {
    tree_.kinematics(q);
  }
  place(q);
  constraint_rows();
  for (int round = 0; round < 2; ++round) {
    double worst = 0.0;
    for (int i = 0; i < m_; ++i) {
      f[i] = x[forces + i] - spec_.targets[i];
      worst = std::max(worst, std::abs(f[i]));
    }
    if (worst < 1e-15) break;
    if (!smallest_step(f.data())) return Status::singular;
    step_ = -a;
    tree_.integrate(q, step_.data());
    tree_.kinematics(q);
    place(q);
    constraint_rows();
  }
  for (int i = 0; i < m_; ++i) f_dot[i] = dense::dot(J_.data() + i * nv, v, nv);
  if (!smallest_step(f_dot.data())) return Status::singular;
  for (int d = 0; d < nv; ++d) v[d] -= a[d];
  return Status::completed;
}

bool Dynamics::switch_values(const double* y, double* out) {
  tree_.kinematics(y);
  place(y);
  body_velocities(y + nq);
  coordinate_rates(y + nq);
  for (int i = 0; i < n_ - m_; ++i) {
    const int count = drillrig::switch_count(spec_.laws[i]);
    if (count == 0) continue;
    if (!drillrig::switches(spec_.laws[i], i, context_, x[i], x_dot[i], out)) return false;
    out += count;
  }
  return true;
}

bool Dynamics::out_of_range() const {
  for (int i = 0; i < n_ - m_; ++i)
    if (x[i] <= spec_.lowest[i] || x[i] >= spec_.highest[i]) return true;
  return false;
}

void Dynamics::points(double* out) const {
  for (const Anchor& anchor : spec_.points) {
    const Vector3d position = world(tree_.frames(), anchor);
    std::memcpy(out, position.data(), sizeof(double) * 3);
    out += 3;
  }
}

double Dynamics::kinetic_energy(const double* y) const {
  const double *v = y + nq, *M = tree_.M();
  double sum = 0.0;
  for (int i = 0; i < nv; ++i) {
    double row = 0.5 * M[i * nv + i] * v[i];
    for (int j = 0; j < i; ++j) row += M[i * nv + j] * v[j];
    sum += v[i] * row;
  }
  return sum;
}

}  // namespace drillrig
