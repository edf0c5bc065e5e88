// What the time loop needs to know of a rig, bound to its equilibrium: plain numbers, checked by the Python side.
#pragma once

#include <memory>
#include <vector>

#include "laws.hpp"
#include "tree.hpp"

namespace drillrig {

struct Anchor {
  int joint;
  double vector[3];
  double w;  // 1: point, 0: direction
};

// Coordinates in the order of their kinds (drillrig_pin/coordinates.py): joints, turns, lines, slides, angles, gears.
struct JointCoordinate {
  int index_q, index_v;
};

// q[follower] - ratio q[leader]: only constraints, and the last of them.
struct GearCoordinate {
  JointCoordinate follower, leader;
  double ratio;
};

struct Coordinates {
  std::vector<JointCoordinate> joints;
  std::vector<GearCoordinate> gears;
  int turns = 0, lines = 0, slides = 0, angles = 0;
  // Turn: a = axis. Line: a = start, b = end. Slide: a = origin, b = point, c = direction. Angle: a = base, b = moving.
  std::vector<Anchor> a, b, c;
  std::vector<int> base, moving;  // joints the wrench acts between

  int others() const { return turns + lines + slides + angles; }
  int size() const { return static_cast<int>(joints.size() + gears.size()) + others(); }
};

enum class Formulation : int { multipliers, null_space, damped };
enum class Correction : int { none, baumgarte, sliding_mode };

struct RigSpec {
  std::shared_ptr<const Tree> tree;
  Coordinates coordinates;
  int constraints = 0;  // the last of the coordinates
  std::vector<Law> laws;  // one per coordinate that is not a constraint
  std::vector<double> series;
  std::vector<double> lowest, highest;  // range of each force's coordinate; infinite: none
  std::vector<double> targets;
  std::vector<JointSpan> spans;      // per joint
  std::vector<signed char> support;  // njoints x nv: 1 where the dof moves the joint
  std::vector<signed char> signs;    // wrenches x nv: support of the moving body less that of the base
  std::vector<Anchor> points;  // tracked
  Formulation formulation = Formulation::multipliers;
  Correction correction = Correction::none;
  double correction_values[3] = {0, 0, 0};  // alpha, beta | rate, gain, width
  int rank = 0;  // independent constraint rows
  double rank_threshold = 1e-9;
};

}  // namespace drillrig
