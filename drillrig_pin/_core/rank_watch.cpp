#include "rank_watch.hpp"

#include <algorithm>

namespace drillrig {

namespace {
constexpr double kWeak = 0.05, kSame = 0.5;
}  // namespace

RankWatch::RankWatch(int m, int nv, double threshold) : m_(m), nv_(nv), threshold_(threshold) {
  if (m_ == 0) return;
  J_.setZero(m, nv);
  last_.setZero(m, nv);
  left_.setZero(m);
  right_.setZero(nv);
  svd_ = Eigen::JacobiSVD<Eigen::MatrixXd>(m, nv, Eigen::ComputeThinU | Eigen::ComputeThinV);
}

bool RankWatch::look(const double* J) {
  if (m_ == 0) return true;
  J_ = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(J, m_, nv_);
  const bool first = rank_ < 0;
  if (!first && (J_ - last_).squaredNorm() <= 0.25 * before_ * before_) return true;
  svd_.compute(J_);
  const auto& values = svd_.singularValues();
  largest_ = std::max(largest_, values[0]);
  const int rank = static_cast<int>((values.array() > threshold_ * largest_).count());
  if (first) rank_ = rank;
  if (rank < rank_ || rank == 0) return false;
  const double value = values[rank - 1];
  bool passed = false;
  if (!first) {
    const double same = svd_.matrixU().col(rank - 1).dot(left_) * svd_.matrixV().col(rank - 1).dot(right_);
    passed = same < (std::max(value, before_) < kWeak * largest_ ? kSame : -kSame);
  }
  left_ = svd_.matrixU().col(rank - 1);
  right_ = svd_.matrixV().col(rank - 1);
  before_ = value;
  last_ = J_;
  return !passed;
}

}  // namespace drillrig
