// The equations of motion of one run: twin of drillrig_pin/dynamics.py. One per thread; no allocation after construction.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <limits>
#include <vector>

#include "pulse.hpp"
#include "rig.hpp"

namespace drillrig {

enum class Status : int { completed = 0, interrupted, diverged, step_too_small, singular, callback_failed, drifted };

class Dynamics {
 public:
  Dynamics(const RigSpec& spec, const LawCallback& callback);

  // Who is asked, at every right-hand side, whether to stop; it then gives `interrupted`, and goes on doing so.
  void listen(Pulse* pulse) { pulse_ = pulse; }
  bool stopped() { return pulse_ != nullptr && pulse_->stop(); }

  int size() const { return nq + nv + 2; }
  int m() const { return m_; }
  int forces() const { return n_ - m_; }
  bool is_load(int force) const { return spec_.laws[force].load; }
  bool simple() const { return simple_; }  // q' = v
  bool projects() const { return m_ > 0 || !simple_; }

  // dy/dt with y = (q, v, work in, work dissipated). Leaves x, x_dot, F, f, f_dot, a, lambda of that state behind.
  Status rate(double t, const double* y, double* dy);
  // Loads whose force depends on time alone: how many, their forces at t, and the accelerations a newton of each causes at
  // the state last evaluated (nv x known; false: rank is lost there).
  int known() const { return static_cast<int>(known_.size()); }
  void known_forces(double t, double* out);
  bool known_responses(Eigen::Ref<Eigen::MatrixXd> out);
  // Puts y back onto f = 0, J v = 0 with the smallest change in the metric of the mass matrix.
  Status project(double* y);
  int switch_count() const { return switches_; }
  bool switch_values(const double* y, double* out);  // false: a callback failed
  // J (m x nv, row-major) at the state last evaluated, and below which fraction of the largest a singular value is zero.
  const double* jacobian() const { return J_.data(); }
  const double* jacobian_at(const double* q);  // the same there; leaves the rest of the state behind undefined
  int rank() const { return spec_.rank; }
  double rank_threshold() const { return spec_.rank_threshold; }
  bool watches_rank() const { return !damped(); }
  // True if a force's coordinate has left its range: a cylinder its stroke.
  bool out_of_range() const;
  void points(double* out) const;
  double kinetic_energy(const double* y) const;
  double potential_energy(const double* y) { return tree_.potential_energy(y); }
  // Gradient rows of all coordinates (n x nv, row-major) at the state last evaluated; only tests look at the forces'.
  void gradient_rows(double* out) const;

  const int nq, nv;
  Eigen::VectorXd x, x_dot, F, f, f_dot, a, lambda, gamma;
  TreeWorkspace& tree() { return tree_; }

 private:
  using Wrench = Eigen::Matrix<double, 6, 1>;

  void place(const double* q);                   // coordinates x and unit wrenches W
  void body_velocities(const double* v);         // spatial velocity of every joint's body
  void coordinate_rates(const double* v);        // x_dot
  void apply_forces(const double* bias);         // p1 = Q - bias
  void constraint_rows();                        // J
  void constraint_bias();                        // gamma = J_dot v
  void stabilise();
  bool solve(const double* p1, const double* p2);
  void eliminate(const double* p1, const double* p2);
  void substitute();
  bool solve_multipliers(const double* p1, const double* p2);
  void solve_by_values(const double* p1, const double* p2);
  bool solve_null_space(const double* p1, const double* p2);
  void invert_on_range();
  void invert_damped();
  bool damped() const { return spec_.formulation == Formulation::damped; }
  bool smallest_step(const double* violation);
  void row_of(int wrench, double* out) const;
  void gear_rows(double* out) const;
  void know_forces(double t);                    // known_now_

  const RigSpec& spec_;
  LawContext context_;
  Pulse* pulse_ = nullptr;
  TreeWorkspace tree_;
  const int n_, m_, joints_;
  const bool simple_;
  int switches_ = 0;
  std::vector<int> known_;
  // Their forces at the time last asked for: steps ask ahead of the rate behind them, a Jacobian many times at one time.
  std::vector<double> known_now_;
  double known_time_ = std::numeric_limits<double>::quiet_NaN();
  bool factored_ = false;  // L_ belongs to a mass matrix evaluated before

  std::vector<Wrench> W_, V_, applied_;                     // per wrench; per joint; per joint
  std::vector<Eigen::Vector3d> end_, axis_, base_axis_;     // per wrench
  std::vector<double> L_, Z_, small_, L_small_, J_;         // Cholesky of M; L^-1 J^T, J M^-1 J^T, its factor; J by rows
  std::vector<double> vectors_;                             // eigenvectors of S_ by rows
  Eigen::VectorXd p1_, p2_, zero_v_, step_, tmp_m_;
  // Only for redundant rows and the formulations without plain multipliers.
  double margin_ = -1.0;  // of S_ around looked_at_; negative: always look
  Eigen::MatrixXd S_, looked_at_, K_, Jt_, Q_, M_full_;
  Eigen::VectorXd tmp_v_, right_;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr_;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
};

}  // namespace drillrig
