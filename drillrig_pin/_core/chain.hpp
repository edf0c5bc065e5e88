// One pass over a tree of revolute and prismatic joints that yields placements, Jacobian columns, mass matrix, bias and
// drift together. Pinocchio computes the same in separate, general algorithms; sharing the pass makes the right-hand side
// of a small rig about twice as fast. Trees with other joints use Pinocchio's algorithms (tree.cpp).
//
// Everything is spatial algebra at the world origin in world axes: twists (v, w), wrenches (force, moment).
// Composite rigid bodies for M and Newton-Euler for the bias: Featherstone, Rigid Body Dynamics Algorithms (2008),
// chapters 5 and 6.
#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace drillrig {

struct ChainJoint {
  int parent;
  bool revolute;
  Eigen::Vector3d axis;     // in the joint's own frame
  Eigen::Matrix3d R0;       // placement of the joint at zero in its parent's frame
  Eigen::Vector3d p0;
  double mass;
  Eigen::Vector3d com;      // of the body, in the joint's frame
  Eigen::Matrix3d inertia;  // about the centre of mass, joint's axes
};

struct Chain {
  std::vector<ChainJoint> joints;  // joints[0] is the world and unused
  Eigen::Vector3d gravity;
};

class ChainState {
 public:
  explicit ChainState(const Chain& chain);

  void kinematics(const double* q);                 // frames, J
  void dynamics(const double* q, const double* v);  // frames, J, V, drift, M (upper triangle by columns), bias
  double potential_energy() const;                  // at the placements last computed

  std::vector<double> frames;  // per joint 12 numbers: world axes x, y, z and origin
  std::vector<double> J;       // per joint 6 numbers
  std::vector<double> M, bias;
  std::vector<Eigen::Matrix<double, 6, 1>> drift;  // acceleration at zero joint accelerations, less gravity

 private:
  struct Body {
    double mass;
    Eigen::Vector3d h;  // mass times centre of mass
    Eigen::Matrix3d I;  // about the world origin
    Eigen::Vector3d force, moment;
  };
  void place(int j, double q);

  const Chain& chain_;
  std::vector<Eigen::Matrix<double, 6, 1>> V_;
  std::vector<Body> bodies_;
};

}  // namespace drillrig
