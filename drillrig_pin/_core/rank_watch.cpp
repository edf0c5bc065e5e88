#include "rank_watch.hpp"

#include <algorithm>
#include <cmath>

namespace drillrig {

namespace {
constexpr double kWeak = 0.05, kSame = 0.5;
// Eigenvalues of J J^T are squares and carry half the digits: enough to tell whether a closer look is needed.
constexpr double kCloser = 2.0 * kWeak;
}  // namespace

RankWatch::RankWatch(int m, int nv, double threshold) : m_(m), nv_(nv), threshold_(threshold) {
  if (m_ == 0) return;
  J_.setZero(m, nv);
  S_.setZero(m, m);
  left_.setZero(m);
  right_.setZero(nv);
  eigen_.compute(S_);  // makes its memory; a solver not yet used must not be copied (it holds a flag never set)
  svd_ = Eigen::JacobiSVD<Eigen::MatrixXd>(m, nv, Eigen::ComputeThinU | Eigen::ComputeThinV);
}

bool RankWatch::look(const double* J) {
  if (m_ == 0) return true;
  J_ = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(J, m_, nv_);
  if (rank_ == m_) {
    S_.noalias() = J_ * J_.transpose();
    eigen_.compute(S_, Eigen::EigenvaluesOnly);
    const double smallest = std::sqrt(std::max(0.0, eigen_.eigenvalues()[0]));
    largest_ = std::max(largest_, std::sqrt(eigen_.eigenvalues()[m_ - 1]));
    if (smallest > kCloser * largest_) {
      before_ = smallest;
      have_vectors_ = false;
      return true;
    }
  }
  svd_.compute(J_);
  const auto& values = svd_.singularValues();
  largest_ = std::max(largest_, values[0]);
  const int rank = static_cast<int>((values.array() > threshold_ * largest_).count());
  if (rank_ < 0) rank_ = rank;
  if (rank < rank_ || rank == 0) return false;
  const double value = values[rank - 1];
  bool passed = false;
  if (have_vectors_ && std::max(value, before_) < kWeak * largest_)
    passed = svd_.matrixU().col(rank - 1).dot(left_) * svd_.matrixV().col(rank - 1).dot(right_) < kSame;
  left_ = svd_.matrixU().col(rank - 1);
  right_ = svd_.matrixV().col(rank - 1);
  before_ = value;
  have_vectors_ = true;
  return !passed;
}

}  // namespace drillrig
