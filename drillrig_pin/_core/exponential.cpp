#include "exponential.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

namespace drillrig {

using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
constexpr int P = ExponentialAdams::kOrder, kNodes = P + 1;
// Coefficients of the first difference left out by Adams-Bashforth of order 3 and 8 (Hairer, Norsett, Wanner I, III.1).
constexpr double kLeftOutLow = 3.0 / 8.0, kLeftOut = 1070017.0 / 3628800.0;
// The same of Adams-Moulton.
constexpr double kWorkLeftOutLow = 1.0 / 24.0, kWorkLeftOut = 33953.0 / 3628800.0;
// Beyond this many radians of the fastest vibration a step, a polynomial of high order continues little but its ripple.
constexpr double kCoarse = 3.0;
// Steps of the difference quotients, as in stiff.cpp.
constexpr double kPosition = 1e-7, kVelocity = 1e-5;
// Size of hA up to which its exponential is of any use: every doubling loses a bit.
constexpr double kLargest = 1e12;
constexpr int kTerms = 18;  // of the Taylor series, with an argument of at most about one

// Lobatto's points of a step of length one: both ends are among them, and one step's end is the next one's start.
constexpr int kInside = 5;
constexpr double kPoint[kInside] = {0.0, 0.1726731646460114, 0.5, 0.8273268353539886, 1.0};

// Coefficients of the polynomials that are one at one of the nodes and zero at the others: column j, row i for s^i.
MatrixXd lagrange(const double* nodes, int count) {
  MatrixXd out = MatrixXd::Zero(count, count);
  for (int j = 0; j < count; ++j) {
    double divisor = 1.0;
    int degree = 0;
    out(0, j) = 1.0;
    for (int k = 0; k < count; ++k) {
      if (k == j) continue;
      divisor *= nodes[j] - nodes[k];
      ++degree;
      for (int i = degree; i > 0; --i) out(i, j) = out(i - 1, j) - nodes[k] * out(i, j);
      out(0, j) *= -nodes[k];
    }
    out.col(j) /= divisor;
  }
  return out;
}

constexpr std::array<double, kNodes + 1> kFactorial = [] {
  std::array<double, kNodes + 1> f{1.0};
  for (int i = 1; i <= kNodes; ++i) f[i] = f[i - 1] * i;
  return f;
}();

// Adams-Moulton: weight of every node 0, -1, ... in the integral of the polynomial through them from -1 to 0; by Gauss's
// formula of five points, exact up to degree 9.
VectorXd last_interval(int count) {
  VectorXd weights = VectorXd::Zero(count);
  constexpr double x[] = {0.0, 0.5384693101056831, 0.9061798459386640};
  constexpr double w[] = {0.5688888888888889, 0.4786286704993665, 0.2369268850561891};
  for (int k = -2; k <= 2; ++k) {
    const double s = -0.5 + 0.5 * (k < 0 ? -x[-k] : x[k]);
    for (int j = 0; j < count; ++j) {
      double value = 0.5 * w[std::abs(k)];
      for (int i = 0; i < count; ++i)
        if (i != j) value *= (s + i) / (i - j);
      weights[j] += value;
    }
  }
  return weights;
}

}  // namespace

void Past::push(const double* column) {
  head_ = head_ == 0 ? capacity_ - 1 : head_ - 1;
  std::memcpy(data_.data() + static_cast<std::ptrdiff_t>(head_) * rows_, column, sizeof(double) * rows_);
  std::memcpy(data_.data() + static_cast<std::ptrdiff_t>(head_ + capacity_) * rows_, column, sizeof(double) * rows_);
  count_ = std::min(count_ + 1, capacity_);
}

ExponentialAdams::ExponentialAdams(Dynamics& dynamics)
    : dynamics_(dynamics),
      n_(dynamics.nq + dynamics.nv),
      // Where q' = v the first nq rows are linear.
      first_(dynamics.simple() ? dynamics.nq : 0),
      rows_(n_ - first_),
      known_(dynamics.known()),
      states_(dynamics.size(), kNodes),
      rates_(dynamics.size(), kNodes),
      remainders_(rows_, kNodes),
      forces_(known_, kNodes) {
  A_ = Z_ = power_ = sum_ = spare_ = MatrixXd::Zero(n_, n_);
  B_.setZero(n_, rows_ * P);
  R_.setZero(n_, known_);
  C_.setZero(n_, known_ * kInside);
  ahead_ = VectorXd::Zero(known_ * kInside);
  phi_.assign(P + 1, MatrixXd::Zero(n_, n_));
  g_ = VectorXd::Zero(rows_);
  moved_ = rate_ = VectorXd::Zero(dynamics.size());
  inside_ = lagrange(kPoint, kInside);
  set_order(P);
}

void ExponentialAdams::set_order(int order) {
  if (order == order_) return;
  order_ = order;
  prepared_ = false;
  double nodes[P];
  for (int j = 0; j < order; ++j) nodes[j] = -j;
  monomials_ = lagrange(nodes, order);
  moulton_ = last_interval(order + 1);
  // (-1)^j binomial(order, j): the backward difference.
  difference_ = VectorXd::Ones(order + 1);
  for (int j = 1; j <= order; ++j) difference_[j] = -difference_[j - 1] * (order - j + 1) / j;
}

void ExponentialAdams::forget() {
  reached_ = std::numeric_limits<double>::quiet_NaN();
  states_.clear();
  rates_.clear();
  remainders_.clear();
  forces_.clear();
  empty_ = true;
}

void ExponentialAdams::begin(double spacing) {
  forget();
  empty_ = false;
  prepared_ = prepared_ && spacing == h_;
  h_ = spacing;
  set_order(spacing * fastest() > kCoarse ? kLowOrder : kOrder);
  age_ = 0;
}

long ExponentialAdams::take_evaluations() {
  const long count = evaluations_;
  evaluations_ = 0;
  return count;
}

Status ExponentialAdams::linearise(double t, const double* y, const double* f) {
  std::memcpy(moved_.data(), y, sizeof(double) * moved_.size());
  for (int k = 0; k < n_; ++k) {
    const double delta = (k < dynamics_.nq ? kPosition : kVelocity) * std::max(1.0, std::abs(y[k]));
    moved_[k] = y[k] + delta;
    ++evaluations_;
    const Status status = dynamics_.rate(t, moved_.data(), rate_.data());
    if (status != Status::completed) return status;
    for (int i = 0; i < n_; ++i) A_(i, k) = (rate_[i] - f[i]) / (moved_[k] - y[k]);
    moved_[k] = y[k];
  }
  if (known_ > 0) {
    ++evaluations_;
    const Status status = dynamics_.rate(t, y, rate_.data());
    if (status != Status::completed) return status;
    if (!dynamics_.known_responses(R_.bottomRows(dynamics_.nv))) return Status::singular;
  }
  age_ = 0;
  linearised_ = true;
  prepared_ = false;
  recompute_remainders();
  return A_.allFinite() ? Status::completed : Status::diverged;
}

// The accelerations' part of A due to positions holds squares of frequencies.
double ExponentialAdams::fastest() const {
  return std::max(1e-3, std::sqrt(A_.bottomLeftCorner(dynamics_.nv, dynamics_.nq).norm()));
}

double ExponentialAdams::guess(double rtol) const {
  // A loose tolerance is met by the longest steps, of low order.
  const double share = rtol > 3e-3 ? 1.2 : 0.5;
  return share * std::pow(rtol / 1e-8, 1.0 / (P + 1)) / fastest();
}

void ExponentialAdams::remainder(const double* y, const double* f, const double* known, double* g) const {
  Map<VectorXd> out(g, rows_);
  out.noalias() = -A_.bottomRows(rows_).lazyProduct(Map<const VectorXd>(y, n_));
  out += Map<const VectorXd>(f + first_, rows_);
  if (known_ > 0) out.noalias() -= R_.bottomRows(rows_).lazyProduct(Map<const VectorXd>(known, known_));
}

void ExponentialAdams::recompute_remainders() {
  remainders_.clear();
  for (int j = rates_.count() - 1; j >= 0; --j) {
    remainder(states_.column(j), rates_.column(j), forces_.column(j), g_.data());
    remainders_.push(g_.data());
  }
}

void ExponentialAdams::push(double t, const double* y, const double* f) {
  states_.push(y);
  rates_.push(f);
  for (int i = 0; i < 2; ++i) peak_[i] = std::max(peak_[i], std::abs(f[n_ + i]));
  if (known_ > 0) {
    double* reached = ahead_.data() + known_ * (kInside - 1);
    if (!(std::abs(t - reached_) <= 1e-9 * h_)) dynamics_.known_forces(t, reached);
    forces_.push(reached);
  }
  remainder(y, f, forces_.column(0), g_.data());
  remainders_.push(g_.data());
  ++age_;
}

// phi_0 = exp, phi_k(z) = (phi_{k-1}(z) - 1 / (k-1)!) / z at z = hA: a Taylor series for the last one at z / 2^s, the others
// downwards from it, then s times from z to 2 z. Powers tell the size of z: its own norm mixes units.
bool ExponentialAdams::phi_functions() {
  Z_ = h_ * A_;
  power_.noalias() = Z_ * Z_;
  double size = std::sqrt(power_.lpNorm<Eigen::Infinity>());
  spare_.noalias() = power_ * Z_;
  size = std::max(size, std::cbrt(spare_.lpNorm<Eigen::Infinity>()));
  if (!(size < kLargest)) return false;
  const int doublings = size > 1.0 ? static_cast<int>(std::ceil(std::log2(size))) : 0;
  Z_ *= std::ldexp(1.0, -doublings);
  MatrixXd& last = phi_[P];
  power_.setIdentity();
  power_ /= kFactorial[P];
  last = power_;
  for (int j = 1; j <= kTerms; ++j) {
    spare_.noalias() = power_ * Z_;
    power_ = spare_ / (P + j);
    last += power_;
    if (dynamics_.stopped()) return false;
  }
  for (int k = P; k > 0; --k) {
    phi_[k - 1].noalias() = Z_ * phi_[k];
    phi_[k - 1].diagonal().array() += 1.0 / kFactorial[k - 1];
  }
  for (int s = 0; s < doublings; ++s) {
    for (int k = P; k >= 0; --k) {
      sum_.noalias() = phi_[0] * phi_[k];
      for (int j = 1; j <= k; ++j) sum_ += phi_[j] / kFactorial[k - j];
      phi_[k] = sum_ * std::ldexp(1.0, -k);
    }
    if (dynamics_.stopped()) return false;
  }
  return true;
}

bool ExponentialAdams::prepare() {
  if (prepared_) return true;
  if (!phi_functions()) return false;
  for (int j = 0; j < order_; ++j) {
    auto block = B_.middleCols(rows_ * j, rows_);
    block.setZero();
    for (int i = 0; i < order_; ++i) block += (h_ * monomials_(i, j) * kFactorial[i]) * phi_[i + 1].rightCols(rows_);
  }
  for (int k = 0; k < kInside; ++k) {
    auto block = C_.middleCols(known_ * k, known_);
    block.setZero();
    for (int i = 0; i < kInside; ++i) block.noalias() += (h_ * inside_(i, k) * kFactorial[i]) * phi_[i + 1] * R_;
  }
  prepared_ = true;
  return true;
}

void ExponentialAdams::error(VectorXd& out) {
  g_.setZero();
  for (int j = 0; j <= order_; ++j) g_ += difference_[j] * Map<const VectorXd>(remainders_.column(j), rows_);
  out.setZero();
  out.segment(first_, rows_) = ((order_ == P ? kLeftOut : kLeftOutLow) * h_) * g_;
}

double ExponentialAdams::work_error() const {
  double largest = 0.0;
  for (int i = 0; i < 2; ++i) {
    double sum = 0.0;
    for (int j = 0; j <= order_; ++j) sum += difference_[j] * rates_.column(j)[n_ + i];
    if (peak_[i] > 0.0) largest = std::max(largest, std::abs(sum) / peak_[i]);
  }
  return (order_ == P ? kWorkLeftOut : kWorkLeftOutLow) * largest;
}

void ExponentialAdams::step(double t, const double* y, double* y_new, double bound) {
  Map<VectorXd> out(y_new, n_);
  out.noalias() = phi_[0] * Map<const VectorXd>(y, n_);
  out.noalias() += B_.leftCols(rows_ * order_) * Map<const VectorXd>(remainders_.column(0), rows_ * order_);
  if (known_ == 0) return;
  std::memcpy(ahead_.data(), forces_.column(0), sizeof(double) * known_);
  // Nothing behind the bound is looked at: a force may jump there.
  for (int k = 1; k < kInside; ++k)
    dynamics_.known_forces(std::min(t + kPoint[k] * h_, bound), ahead_.data() + known_ * k);
  reached_ = t + h_;
  out.noalias() += C_ * ahead_;
}

void ExponentialAdams::work(const double* y, const double* f_new, double* y_new) const {
  for (int i = n_; i < n_ + 2; ++i) {
    double sum = moulton_[0] * f_new[i];
    for (int j = 1; j <= order_; ++j) sum += moulton_[j] * rates_.column(j - 1)[i];
    y_new[i] = y[i] + h_ * sum;
  }
}

}  // namespace drillrig
