// Pinocchio's algorithms behind plain pointers.
#include "tree.hpp"

#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/energy.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include "chain.hpp"
#include "tree_impl.hpp"

namespace drillrig {

namespace {
using ConstVector = Eigen::Map<const Eigen::VectorXd>;
using Vector = Eigen::Map<Eigen::VectorXd>;

// Pinocchio's own workspace holds four tensors of nv^3 numbers that nothing here asks for; see tree_data.py.
constexpr int kLarge = 100;

pinocchio::Data make_data(const pinocchio::Model& model) {
  if (model.nv < kLarge || model.nvExtended != model.nv) return pinocchio::Data(model);
  const std::size_t n = model.njoints;
  const int nv = model.nv;
  pinocchio::Data data;
  for (const auto& joint : model.joints) data.joints.push_back(joint.createData());
  for (auto* motions : {&data.a, &data.oa, &data.v, &data.ov, &data.a_gf, &data.oa_gf})
    motions->assign(n, pinocchio::Motion::Zero());
  for (auto* forces : {&data.f, &data.of, &data.h, &data.oh}) forces->assign(n, pinocchio::Force::Zero());
  for (auto* placements : {&data.oMi, &data.liMi}) placements->assign(n, pinocchio::SE3::Identity());
  for (auto* inertias : {&data.Ycrb, &data.oYcrb}) inertias->assign(n, pinocchio::Inertia::Zero());
  for (auto* columns : {&data.J, &data.dJ, &data.Ag}) columns->setZero(6, nv);
  for (auto* vector : {&data.nle, &data.g, &data.tau}) vector->setZero(nv);
  data.M.setZero(nv, nv);
  data.Fcrb.assign(n, pinocchio::Data::Matrix6x::Zero(6, nv));
  data.mass.assign(n, 0.0);
  data.com.assign(n, Eigen::Vector3d::Zero());
  data.nvSubtree.assign(n, 0);
  for (std::size_t i = n - 1; i > 0; --i) {
    data.nvSubtree[i] += model.joints[i].nv();
    data.nvSubtree[model.parents[i]] += data.nvSubtree[i];
  }
  std::vector<int> last(n, -1);
  data.parents_fromRow.assign(nv, -1);
  data.idx_vExtended_to_idx_v_fromRow.resize(nv);
  for (int row = 0; row < nv; ++row) data.idx_vExtended_to_idx_v_fromRow[row] = row;
  for (std::size_t i = 1; i < n; ++i) {
    int before = last[model.parents[i]];
    const int first = model.joints[i].idx_v();
    for (int row = first; row < first + model.joints[i].nv(); ++row) data.parents_fromRow[row] = before, before = row;
    last[i] = before;
  }
  data.non_mimic_parents_fromRow = data.parents_fromRow;
  return data;
}
}  // namespace

struct TreeState {
  explicit TreeState(const TreeImpl& impl)
      : data(make_data(impl.model)),
        q(impl.model.nq),
        v(impl.model.nv),
        q2(impl.model.nq),
        zero(Eigen::VectorXd::Zero(impl.model.nv)) {
    if (impl.chain) chain = std::make_unique<ChainState>(*impl.chain);
  }
  pinocchio::Data data;
  Eigen::VectorXd q, v, q2, zero;  // Pinocchio's templates take plain vectors
  std::unique_ptr<ChainState> chain;
};

TreeWorkspace::TreeWorkspace(const Tree& tree) : tree_(tree), state_(std::make_unique<TreeState>(tree.impl())) {
  static_assert(sizeof(pinocchio::SE3) == 12 * sizeof(double), "placements are read as twelve numbers in a row");
  pinocchio::Data& data = state_->data;
  if (ChainState* chain = state_->chain.get()) {
    J_ = chain->J.data(), frames_ = chain->frames.data(), M_ = chain->M.data(), bias_ = chain->bias.data();
  } else {
    J_ = data.J.data(), frames_ = data.oMi[0].rotation().data(), M_ = data.M.data(), bias_ = data.nle.data();
  }
}
TreeWorkspace::~TreeWorkspace() = default;

void TreeWorkspace::kinematics(const double* q) {
  if (state_->chain) return state_->chain->kinematics(q);
  const auto& model = tree_.impl().model;
  state_->q = ConstVector(q, model.nq);
  pinocchio::computeJointJacobians(model, state_->data, state_->q);
}

void TreeWorkspace::dynamics(const double* q, const double* v) {
  if (state_->chain) return state_->chain->dynamics(q, v);
  const auto& model = tree_.impl().model;
  state_->q = ConstVector(q, model.nq);
  state_->v = ConstVector(v, model.nv);
  pinocchio::nonLinearEffects(model, state_->data, state_->q, state_->v);
  // In the world convention it leaves placements and Jacobian columns behind as well.
  pinocchio::crba(model, state_->data, state_->q, pinocchio::Convention::WORLD);
}

void TreeWorkspace::drift(int joint, double* A) const {
  Eigen::Map<Eigen::Matrix<double, 6, 1>> result(A);
  const auto& data = state_->data;
  // Both keep the acceleration with gravity taken off; Pinocchio in the body's own frame.
  if (state_->chain) {
    result = state_->chain->drift[joint];
  } else {
    result = data.oMi[joint].act(data.a_gf[joint]).toVector();
  }
  result += tree_.impl().model.gravity.toVector();
}

double TreeWorkspace::potential_energy(const double* q) {
  if (state_->chain) return state_->chain->potential_energy();
  const auto& model = tree_.impl().model;
  state_->q = ConstVector(q, model.nq);
  return pinocchio::computePotentialEnergy(model, state_->data, state_->q);
}

void TreeWorkspace::crba_and_rnea(const double* q, const double* v) {
  const auto& model = tree_.impl().model;
  state_->q = ConstVector(q, model.nq);
  state_->v = ConstVector(v, model.nv);
  pinocchio::crba(model, state_->data, state_->q, pinocchio::Convention::LOCAL);
  pinocchio::rnea(model, state_->data, state_->q, state_->v, state_->zero);
}

void TreeImpl::find_chain() {
  pinocchio::Data data = make_data(model);
  const Eigen::VectorXd q = pinocchio::neutral(model);
  pinocchio::computeJointJacobians(model, data, q);
  auto found = std::make_unique<Chain>();
  found->gravity = model.gravity.linear();
  found->joints.resize(model.njoints);
  for (int j = 1; j < model.njoints; ++j) {
    const auto& joint = model.joints[j];
    // Dofs in the order of the joints, one each.
    if (joint.nq() != 1 || joint.nv() != 1 || joint.idx_v() != j - 1) return;
    const Eigen::Matrix<double, 6, 1> S = data.oMi[j].actInv(pinocchio::Motion(data.J.col(j - 1))).toVector();
    const bool turns = S.tail<3>().norm() > 0.5, slides = S.head<3>().norm() > 1e-12;
    if (turns && slides) return;  // a screw
    const auto& placement = model.jointPlacements[j];
    const auto& inertia = model.inertias[j];
    found->joints[j] = {static_cast<int>(model.parents[j]),
                        turns,
                        turns ? Eigen::Vector3d(S.tail<3>()) : Eigen::Vector3d(S.head<3>()),
                        placement.rotation(),
                        placement.translation(),
                        inertia.mass(),
                        inertia.lever(),
                        inertia.inertia().matrix()};
  }
  chain = std::move(found);
}

void TreeWorkspace::rate(const double* q, const double* v, double* dq) const {
  const auto& model = tree_.impl().model;
  for (int i = 1; i < model.njoints; ++i) {
    const auto& joint = model.joints[i];
    const int iq = joint.idx_q(), iv = joint.idx_v();
    if (joint.nq() == joint.nv()) {
      for (int k = 0; k < joint.nq(); ++k) dq[iq + k] = v[iv + k];
    } else {
      const double x = q[iq + 3], y = q[iq + 4], z = q[iq + 5], w = q[iq + 6];
      const Eigen::Matrix3d R = Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix();
      Eigen::Map<Eigen::Vector3d>(dq + iq).noalias() = R * Eigen::Map<const Eigen::Vector3d>(v + iv);
      const double wx = v[iv + 3], wy = v[iv + 4], wz = v[iv + 5];
      dq[iq + 3] = 0.5 * (w * wx + y * wz - z * wy);
      dq[iq + 4] = 0.5 * (w * wy + z * wx - x * wz);
      dq[iq + 5] = 0.5 * (w * wz + x * wy - y * wx);
      dq[iq + 6] = 0.5 * (-x * wx - y * wy - z * wz);
    }
  }
}

void TreeWorkspace::integrate(double* q, const double* step) const {
  const auto& model = tree_.impl().model;
  state_->q = ConstVector(q, model.nq);
  state_->v = ConstVector(step, model.nv);
  pinocchio::integrate(model, state_->q, state_->v, state_->q2);
  Vector(q, model.nq) = state_->q2;
}

void TreeWorkspace::normalize(double* q) const {
  const auto& model = tree_.impl().model;
  state_->q = ConstVector(q, model.nq);
  pinocchio::normalize(model, state_->q);
  Vector(q, model.nq) = state_->q;
}

}  // namespace drillrig
