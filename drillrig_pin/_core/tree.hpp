// The multibody tree: the only door to Pinocchio. Its headers cost a minute and 2 GB per file, so they stay in tree*.cpp.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace drillrig {

// Where a joint hangs in the tree and which dofs are its own.
struct JointSpan {
  int parent, first, count;
};

// The release these sources were compiled with.
const char* pinocchio_version();

struct TreeImpl;
struct TreeState;

// Immutable model, shared by all threads.
class Tree {
 public:
  // text: what pinocchio::Model::saveToString() wrote, in Python, with the same version of the library.
  explicit Tree(const std::string& text);
  ~Tree();
  Tree(const Tree&) = delete;
  Tree& operator=(const Tree&) = delete;

  int nq() const;
  int nv() const;
  int njoints() const;
  std::vector<JointSpan> spans() const;
  bool simple() const;  // dq/dt = v: no floating joint

  const TreeImpl& impl() const { return *impl_; }

 private:
  std::unique_ptr<TreeImpl> impl_;
};

// One workspace per run. Arrays belong to it and are true for the state last given.
class TreeWorkspace {
 public:
  explicit TreeWorkspace(const Tree& tree);
  ~TreeWorkspace();
  TreeWorkspace(const TreeWorkspace&) = delete;
  TreeWorkspace& operator=(const TreeWorkspace&) = delete;

  void kinematics(const double* q);                 // frames, J
  void dynamics(const double* q, const double* v);  // frames, J, M (CRBA), bias C v + g (RNEA), accelerations
  double potential_energy(const double* q);         // after either of them
  // For timing: what the bar of this package's speed is measured in.
  void crba_and_rnea(const double* q, const double* v);

  const double* J() const { return J_; }            // 6 x nv by columns: unit twist of each dof at the world origin
  // Spatial acceleration (linear, angular; world origin and axes) of a joint's body if all joint accelerations were zero.
  void drift(int joint, double* A) const;
  const double* frames() const { return frames_; }  // per joint 12 numbers: world axes x, y, z and origin
  const double* M() const { return M_; }            // nv x nv, upper triangle
  const double* nle() const { return bias_; }       // nv

  void rate(const double* q, const double* v, double* dq) const;  // dq/dt for any joint
  void integrate(double* q, const double* step) const;            // q <- q (+) step
  void normalize(double* q) const;                                // unit quaternions

 private:
  const Tree& tree_;
  std::unique_ptr<TreeState> state_;
  const double *J_, *frames_, *M_, *bias_;
};

}  // namespace drillrig
