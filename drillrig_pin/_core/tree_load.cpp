// Reading the model from text, apart from the algorithms: serialization headers are expensive on their own.
#include "tree_impl.hpp"

#include <pinocchio/config.hpp>
#include <pinocchio/serialization.hpp>

namespace drillrig {

const char* pinocchio_version() { return PINOCCHIO_VERSION; }

Tree::Tree(const std::string& text) : impl_(std::make_unique<TreeImpl>()) {
  impl_->model.loadFromString(text);
  impl_->find_chain();
}
Tree::~Tree() = default;

int Tree::nq() const { return impl_->model.nq; }
int Tree::nv() const { return impl_->model.nv; }
int Tree::njoints() const { return impl_->model.njoints; }
std::vector<JointSpan> Tree::spans() const {
  const auto& model = impl_->model;
  std::vector<JointSpan> spans{{0, 0, 0}};
  for (int j = 1; j < model.njoints; ++j)
    spans.push_back({static_cast<int>(model.parents[j]), model.joints[j].idx_v(), model.joints[j].nv()});
  return spans;
}
bool Tree::simple() const { return impl_->model.nq == impl_->model.nv; }

}  // namespace drillrig
