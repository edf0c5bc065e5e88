// Looks at the constraints behind every accepted step: twin of drillrig_pin/constraint_watch.py, which says how.
#pragma once

#include <Eigen/Core>
#include <Eigen/SVD>
#include <vector>

#include "stepper.hpp"

namespace drillrig {

class ConstraintWatch {
 public:
  ConstraintWatch(Dynamics& dynamics, double rtol);

  // At the start, where the dynamics has just been evaluated and still is behind it.
  Status begin(double t, const double* y, const double* dy);
  // Behind an accepted step, at whose end the dynamics has just been evaluated and still is behind it.
  Status step(Stepper& stepper);
  // Of the singular position, if one was met.
  double time() const { return time_; }

 private:
  void take(const double* J);  // into J_
  double smallest(const Eigen::MatrixXd& J);
  double limit() const;
  bool bends_little(double h, const double* y, const double* dy);
  double lost(Stepper& stepper, double left, const Eigen::MatrixXd& J_left, double value_left, double right,
              const Eigen::MatrixXd& J_right, double value_right, int depth);
  void keep(double t, const double* y, const double* dy);

  Dynamics& dynamics_;
  const int m_, nv_, nq_, rank_;
  const bool ranked_;
  const double threshold_, weak_;
  double drift_ = 0.0, time_ = 0.0, t_ = 0.0;
  double largest_ = 0.0, reference_ = 0.0;      // singular values seen: largest, and largest of the smallest
  double slope_ = 0.0, bend_ = 0.0, moved_ = 0.0;  // |dJ| / |dq| at most; of the last step; |J - looked at| behind it
  double value_ = 0.0;                           // smallest singular value of looked_
  bool looked_there_ = true;                     // at the end of the last step
  Eigen::VectorXd q_, qdot_, chord_, state_;
  Eigen::MatrixXd J_, last_, looked_;
  std::vector<Eigen::MatrixXd> middle_;
  Eigen::JacobiSVD<Eigen::MatrixXd> svd_;
};

}  // namespace drillrig
