// Notices that the constraint Jacobian loses rank: twin of RankWatch in drillrig_pin/marching.py.
#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

namespace drillrig {

// Where rank is lost, the smallest singular value crosses zero: behind it the value is positive again, but one of its two
// singular vectors has changed sign, or both have turned.
class RankWatch {
 public:
  RankWatch(int m, int nv, double threshold);

  // Takes in the Jacobian (m x nv, row-major) of the next sample. False: rank is or was lost.
  bool look(const double* J);

 private:
  const int m_, nv_;
  const double threshold_;
  int rank_ = -1;
  double largest_ = 0.0, before_ = 0.0;
  bool have_vectors_ = false;
  Eigen::MatrixXd J_, S_;
  Eigen::VectorXd left_, right_;
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen_;
  Eigen::JacobiSVD<Eigen::MatrixXd> svd_;
};

}  // namespace drillrig
