// Notices that the constraint Jacobian loses rank: twin of RankWatch in drillrig_pin/marching.py.
#pragma once

#include <Eigen/Core>
#include <Eigen/SVD>

namespace drillrig {

// Where rank is lost, the smallest singular value crosses zero: behind it the value is positive again, but one of its two
// singular vectors has changed sign, or both have turned. It changes by no more than the Frobenius norm of the change of
// J (Weyl): within half of it from where J was last looked at, there is nothing to see.
class RankWatch {
 public:
  RankWatch(int m, int nv, double threshold);

  // Takes in the Jacobian (m x nv, row-major) of the next sample. False: rank is or was lost.
  bool look(const double* J);

 private:
  const int m_, nv_;
  const double threshold_;
  int rank_ = -1;  // -1: nothing seen yet
  double largest_ = 0.0, before_ = 0.0;
  Eigen::MatrixXd J_, last_;
  Eigen::VectorXd left_, right_;
  Eigen::JacobiSVD<Eigen::MatrixXd> svd_;
};

}  // namespace drillrig
