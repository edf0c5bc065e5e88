// Shared by the two files that see Pinocchio.
#pragma once

#include <pinocchio/multibody.hpp>

#include "chain.hpp"
#include "tree.hpp"

namespace drillrig {

struct TreeImpl {
  pinocchio::Model model;
  std::unique_ptr<Chain> chain;  // if every joint is revolute or prismatic

  void find_chain();
};

}  // namespace drillrig
