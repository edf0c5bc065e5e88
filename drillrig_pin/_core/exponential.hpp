// Exponential Adams-Bashforth steps of order 8, or 3 where they are long, for machines that vibrate: one right-hand side a
// step.
//
// y' = A y + g(t, y) with A the Jacobian at some state. The linear part is carried over a step exactly, g is continued by
// the polynomial through its last values: y(t + h) = exp(hA) y + sum_j B_j(hA) g(t - j h). Near an equilibrium g holds the
// loads and little else, so neither the frequencies of the machine nor its dampings limit the step.
// Loads that depend on time alone are known ahead and are not continued: with R the response to them, g holds f - A y - R F
// and the integral of exp((h - s)A) R F(t + s) is taken with F interpolated at Lobatto's points of the step.
// Norsett, Lecture Notes in Mathematics 109 (1969); Hochbruck and Ostermann, BIT 51 (2011) 889, Acta Numerica 19 (2010) 209.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "dynamics.hpp"

namespace drillrig {

// The last columns pushed, newest first and contiguous: every one is written twice, half a buffer apart.
class Past {
 public:
  Past(int rows, int capacity) : rows_(rows), capacity_(capacity), data_(Eigen::MatrixXd::Zero(rows, 2 * capacity)) {}
  void push(const double* column);
  int count() const { return count_; }
  void clear() { count_ = 0; }
  double* column(int j) { return data_.data() + static_cast<std::ptrdiff_t>(head_ + j) * rows_; }
  const double* column(int j) const { return data_.data() + static_cast<std::ptrdiff_t>(head_ + j) * rows_; }

 private:
  int rows_, capacity_, head_ = 0, count_ = 0;
  Eigen::MatrixXd data_;
};

class ExponentialAdams {
 public:
  static constexpr int kOrder = 8, kLowOrder = 3;

  explicit ExponentialAdams(Dynamics& dynamics);

  // The past is of no use behind a start or a break.
  void forget();
  // A new past with values at another distance.
  void begin(double spacing);
  bool empty() const { return empty_; }
  bool begins() const { return !empty_ && rates_.count() == 0; }
  // True once there are enough values for a step and its error.
  bool ready() const { return rates_.count() > order_; }
  int order() const { return order_; }
  double spacing() const { return h_; }
  // Jacobian at (t, y) with rate f there, by differences.
  Status linearise(double t, const double* y, const double* f);
  bool linearised() const { return linearised_; }
  // Steps since the spacing or the Jacobian changed.
  long age() const { return age_; }
  // A first guess at the spacing: a fraction of the fastest vibration.
  double guess(double rtol) const;
  void push(double t, const double* y, const double* f);
  // Coefficients for the present Jacobian and spacing, if they are not at hand. False: there are none, the spacing spans
  // far more than the fastest motion, or somebody asked to stop.
  bool prepare();
  // Local error of the step ahead, by component of (q, v).
  void error(Eigen::VectorXd& out);
  // The same of the work done and of that dissipated, the larger one, over the greatest power so far times the spacing:
  // the first difference the formula in work() leaves out.
  double work_error() const;
  // q and v of the step ahead of t; its work follows from the rate at its end.
  void step(double t, const double* y, double* y_new, double bound);
  void work(const double* y, const double* f_new, double* y_new) const;
  long take_evaluations();

 private:
  bool phi_functions();
  void set_order(int order);
  double fastest() const;
  void recompute_remainders();
  void remainder(const double* y, const double* f, const double* known, double* g) const;

  Dynamics& dynamics_;
  const int n_, first_, rows_;  // of (q, v); first row and number of rows in which g is not zero
  const int known_;             // loads that depend on time alone
  int order_ = 0;
  double h_ = 0.0;
  double reached_ = std::numeric_limits<double>::quiet_NaN();  // time of the last values in ahead_
  long age_ = 0, evaluations_ = 0;
  double peak_[2] = {0.0, 0.0};  // greatest power put in and dissipated so far
  bool empty_ = true, linearised_ = false, prepared_ = false;
  Past states_, rates_, remainders_, forces_;
  Eigen::MatrixXd A_, B_, Z_, power_, sum_, spare_;
  Eigen::MatrixXd R_, C_;  // response of (q, v) to the known loads; weights of their values inside a step
  std::vector<Eigen::MatrixXd> phi_;
  Eigen::MatrixXd monomials_;  // of the polynomial through the last values: row i, coefficient of s^i
  Eigen::MatrixXd inside_;     // of that through Lobatto's points
  Eigen::VectorXd moulton_, difference_, g_, moved_, rate_, ahead_;
};

}  // namespace drillrig
