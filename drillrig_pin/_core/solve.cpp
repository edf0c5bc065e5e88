// The saddle-point system M a = p1 + J^T lambda, J a = p2 in its two formulations ([Tram2023] eqs. (57), (58)).
#include <algorithm>
#include <cmath>
#include <cstring>

#include "dense.hpp"
#include "dynamics.hpp"

namespace drillrig {

using Eigen::Map;
using RowMatrix = Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

bool Dynamics::solve(const double* p1, const double* p2) {
  if (spec_.formulation == Formulation::null_space && m_ > 0) {
    factored_ = false;
    return solve_null_space(p1, p2);
  }
  factored_ = dense::factor(tree_.M(), nv, L_.data());
  if (!factored_) return false;
  if (spec_.rank < m_ || damped()) {
    solve_by_values(p1, p2);
    return true;
  }
  return solve_multipliers(p1, p2);
}

// With Z = L^-1 J^T and S = Z^T Z:  S lambda = p2 - Z^T L^-1 p1,  a = L^-T (L^-1 p1 + Z lambda). Needs the factor of M.
// Leaves L^-1 p1 in a, Z, the lower triangle of S in small_ and the right-hand side in lambda.
void Dynamics::eliminate(const double* p1, const double* p2) {
  std::memcpy(a.data(), p1, sizeof(double) * nv);
  dense::forward(L_.data(), nv, a.data());
  for (int i = 0; i < m_; ++i) {
    double* z = Z_.data() + i * nv;
    std::memcpy(z, J_.data() + i * nv, sizeof(double) * nv);
    dense::forward(L_.data(), nv, z);
    for (int j = 0; j <= i; ++j) small_[i * m_ + j] = dense::dot(z, Z_.data() + j * nv, nv);
    lambda[i] = p2[i] - dense::dot(z, a.data(), nv);
  }
}

// a from what `eliminate` left and the multipliers.
void Dynamics::substitute() {
  for (int i = 0; i < m_; ++i) {
    const double* z = Z_.data() + i * nv;
    for (int d = 0; d < nv; ++d) a[d] += z[d] * lambda[i];
  }
  dense::backward(L_.data(), nv, a.data());
}

bool Dynamics::solve_multipliers(const double* p1, const double* p2) {
  eliminate(p1, p2);
  if (m_ > 0) {
    if (!dense::factor(small_.data(), m_, L_small_.data())) return false;
    dense::forward(L_small_.data(), m_, lambda.data());
    dense::backward(L_small_.data(), m_, lambda.data());
  }
  substitute();
  return true;
}

// The same by eigenvalues of S: of all multipliers those of least norm, or the damped ones.
void Dynamics::solve_by_values(const double* p1, const double* p2) {
  eliminate(p1, p2);
  for (int i = 0; i < m_; ++i)
    for (int j = 0; j <= i; ++j) S_(i, j) = S_(j, i) = small_[i * m_ + j];
  if (damped() && (S_ - looked_at_).norm() <= margin_ && dense::factor(small_.data(), m_, L_small_.data())) {
    dense::forward(L_small_.data(), m_, lambda.data());
    dense::backward(L_small_.data(), m_, lambda.data());
    return substitute();
  }
  tmp_m_ = lambda;
  if (damped())
    invert_damped();
  else
    invert_on_range();
  substitute();
}

// lambda = S^+ tmp_m_ on the span of the `rank` largest eigenvalues of S.
void Dynamics::invert_on_range() {
  // Eigen's solver asks for memory at every call.
  dense::eigen(S_.data(), m_, vectors_.data());
  lambda.setZero();
  for (int i = 0; i < m_; ++i) {
    const double value = S_(i, i);
    int larger = 0;
    for (int j = 0; j < m_; ++j) larger += S_(j, j) > value || (S_(j, j) == value && j < i);
    // A value that is not a number stays one.
    if (larger >= spec_.rank) continue;
    double part = 0.0;
    for (int k = 0; k < m_; ++k) part += vectors_[i * m_ + k] * tmp_m_[k];
    for (int k = 0; k < m_; ++k) lambda[k] += vectors_[i * m_ + k] * (part / value);
  }
}

// lambda = sum of w (w . tmp_m_) s / (s^2 + d^2) over eigenvalues s of S: solve_damped in drillrig_pin/dynamics.py.
void Dynamics::invert_damped() {
  if (m_ == 0) return;
  constexpr double kWeak = 0.05, kDamping = 1e-5;
  looked_at_ = S_;
  dense::eigen(S_.data(), m_, vectors_.data());
  lambda.setZero();
  const double largest = S_.diagonal().maxCoeff();
  const double weak = kWeak * kWeak * largest;
  // No direction is weak while S stays this near (Weyl): then plain multipliers do, at a tenth of the cost.
  margin_ = (S_.diagonal().minCoeff() - weak) / (1.0 + kWeak * kWeak);
  for (int i = 0; i < m_; ++i) {
    const double s = S_(i, i), ratio = s / weak;
    const double d = kDamping * weak * std::max(0.0, 1.0 - ratio * ratio);
    double part = 0.0;
    for (int k = 0; k < m_; ++k) part += vectors_[i * m_ + k] * tmp_m_[k];
    part *= s / (s * s + d * d);
    for (int k = 0; k < m_; ++k) lambda[k] += vectors_[i * m_ + k] * part;
  }
}

// R spans the null space of J: [R^T M; J] a = [R^T p1; p2]; then lambda of least norm from J^T lambda = M a - p1.
bool Dynamics::solve_null_space(const double* p1, const double* p2) {
  const Map<const Eigen::VectorXd> applied(p1, nv);
  M_full_ = Map<const Eigen::MatrixXd>(tree_.M(), nv, nv).selfadjointView<Eigen::Upper>();
  const int rank = spec_.rank;
  Jt_ = RowMatrix(J_.data(), m_, nv).transpose();
  qr_.compute(Jt_);
  Q_.setIdentity();
  qr_.householderQ().applyThisOnTheLeft(Q_, tmp_v_);
  for (int i = 0; i < rank; ++i) {
    const int row = qr_.colsPermutation().indices()[i];
    for (int d = 0; d < nv; ++d) K_(i, d) = J_[row * nv + d];
    right_[i] = p2[row];
  }
  for (int i = rank; i < nv; ++i) {
    K_.row(i).noalias() = Q_.col(i).transpose() * M_full_;
    right_[i] = Q_.col(i).dot(applied);
  }
  lu_.compute(K_);
  a.noalias() = lu_.permutationP() * right_;
  lu_.matrixLU().triangularView<Eigen::UnitLower>().solveInPlace(a);
  lu_.matrixLU().triangularView<Eigen::Upper>().solveInPlace(a);
  if (!a.allFinite()) return false;
  right_.noalias() = M_full_ * a;
  right_ -= applied;
  S_.noalias() = Jt_.transpose() * Jt_;
  tmp_m_.noalias() = Jt_.transpose() * right_;
  invert_on_range();
  return true;
}

bool Dynamics::smallest_step(const double* violation) {
  if (spec_.rank == m_ && !damped()) return solve_multipliers(zero_v_.data(), violation);
  solve_by_values(zero_v_.data(), violation);
  return true;
}

}  // namespace drillrig
