#include "chain.hpp"

#include <cmath>

namespace drillrig {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Wrench = Eigen::Matrix<double, 6, 1>;

ChainState::ChainState(const Chain& chain) : chain_(chain) {
  const std::size_t n = chain.joints.size();
  frames.assign(12 * n, 0.0);
  frames[0] = frames[4] = frames[8] = 1.0;
  J.assign(6 * (n - 1), 0.0);
  M.assign((n - 1) * (n - 1), 0.0);
  bias.assign(n - 1, 0.0);
  V_.assign(n, Wrench::Zero());
  drift.assign(n, Wrench::Zero());
  drift[0].head<3>() = -chain.gravity;
  bodies_.resize(n);
}

// R_j = R_parent R0 exp(axis q), p_j = p_parent + R_parent p0; the Jacobian column is the joint's unit twist.
void ChainState::place(int j, double q) {
  const ChainJoint& joint = chain_.joints[j];
  const double* parent = frames.data() + 12 * joint.parent;
  const Map<const Matrix3d> R_parent(parent);
  Map<Matrix3d> R(frames.data() + 12 * j);
  Map<Vector3d> p(frames.data() + 12 * j + 9), linear(J.data() + 6 * (j - 1)), angular(J.data() + 6 * (j - 1) + 3);
  Matrix3d zero;
  zero.noalias() = R_parent * joint.R0;
  p.noalias() = R_parent * joint.p0;
  p += Map<const Vector3d>(parent + 9);
  const Vector3d axis = zero * joint.axis;
  if (joint.revolute) {
    // Rodrigues: columns of R are those of `zero` turned about the world axis.
    const double s = std::sin(q), c = std::cos(q);
    for (int k = 0; k < 3; ++k) {
      const Vector3d e = zero.col(k);
      R.col(k) = c * e + s * axis.cross(e) + ((1.0 - c) * axis.dot(e)) * axis;
    }
    linear = p.cross(axis);
    angular = axis;
  } else {
    R = zero;
    p += q * axis;
    linear = axis;
    angular.setZero();
  }
}

void ChainState::kinematics(const double* q) {
  for (std::size_t j = 1; j < chain_.joints.size(); ++j) place(static_cast<int>(j), q[j - 1]);
}

void ChainState::dynamics(const double* q, const double* v) {
  const int n = static_cast<int>(chain_.joints.size());
  for (int j = 1; j < n; ++j) {
    place(j, q[j - 1]);
    const ChainJoint& joint = chain_.joints[j];
    const Map<const Wrench> S(J.data() + 6 * (j - 1));
    const Wrench Sv = S * v[j - 1];
    const Wrench V = V_[joint.parent] + Sv;
    V_[j] = V;
    const Vector3d v0 = V.head<3>(), w = V.tail<3>();
    Wrench A = drift[joint.parent];
    A.head<3>() += w.cross(Sv.head<3>()) + v0.cross(Sv.tail<3>());
    A.tail<3>() += w.cross(Sv.tail<3>());
    drift[j] = A;

    const Map<const Matrix3d> R(frames.data() + 12 * j);
    const Vector3d c = R * joint.com + Map<const Vector3d>(frames.data() + 12 * j + 9);
    Body& body = bodies_[j];
    const double m = joint.mass;
    body.mass = m;
    body.h = m * c;
    Matrix3d half;
    half.noalias() = R * joint.inertia;
    body.I.noalias() = half * R.transpose();
    body.I.noalias() -= body.h * c.transpose();
    body.I.diagonal().array() += body.h.dot(c);

    const Vector3d a0 = A.head<3>(), alpha = A.tail<3>();
    const Vector3d momentum = m * v0 + w.cross(body.h);
    const Vector3d angular = body.I * w + body.h.cross(v0);
    body.force = m * a0 + alpha.cross(body.h) + w.cross(momentum);
    body.moment = body.I * alpha + body.h.cross(a0) + w.cross(angular) + v0.cross(momentum);
  }
  const int nv = n - 1;
  for (int j = n - 1; j > 0; --j) {
    const Body& body = bodies_[j];
    const Map<const Wrench> S(J.data() + 6 * (j - 1));
    const Vector3d linear = S.head<3>(), angular = S.tail<3>();
    bias[j - 1] = linear.dot(body.force) + angular.dot(body.moment);
    Wrench F;
    F.head<3>() = body.mass * linear + angular.cross(body.h);
    F.tail<3>() = body.I * angular + body.h.cross(linear);
    double* column = M.data() + nv * (j - 1);
    for (int i = j; i > 0; i = chain_.joints[i].parent) column[i - 1] = F.dot(Map<const Wrench>(J.data() + 6 * (i - 1)));
    const int parent = chain_.joints[j].parent;
    if (parent == 0) continue;
    Body& below = bodies_[parent];
    below.mass += body.mass;
    below.h += body.h;
    below.I += body.I;
    below.force += body.force;
    below.moment += body.moment;
  }
}

double ChainState::potential_energy() const {
  double sum = 0.0;
  for (std::size_t j = 1; j < chain_.joints.size(); ++j) {
    const ChainJoint& joint = chain_.joints[j];
    const Map<const Matrix3d> R(frames.data() + 12 * j);
    const Vector3d c = R * joint.com + Map<const Vector3d>(frames.data() + 12 * j + 9);
    sum -= joint.mass * chain_.gravity.dot(c);
  }
  return sum;
}

}  // namespace drillrig
