#include "sysid/linearization/candidate_batch.h"

#include <algorithm>

#include "glog/logging.h"
#include "models/error.h"

namespace sysid {

CandidateBatch::CandidateBatch(const Model& fitted, By by)
    : by_(by),
      sees_rates_(Workspace<double>(fitted).sensors_read_rates),
      model_(fitted) {}

bool CandidateBatch::TakeIn(const Candidate& candidate, int set, int column) {
  const std::string& name =
      candidate.parameters[candidate.ParameterOf(set, column)].name;
  const ProbeSet& probes = candidate.sets[set];
  const Probe* probe =
      column < static_cast<int>(probes.size()) ? &probes[column] : nullptr;
  const double secant = probe != nullptr ? probe->secant : 0.0;
  const int joint = JointOf(candidate, set, column);
  if ((!names_.empty() && !GoesWith(secant, joint)) ||
      std::find(names_.begin(), names_.end(), name) != names_.end() ||
      (probe != nullptr && !Admit(candidate, candidate.At(*probe)))) {
    return false;
  }
  secants_.push_back(secant);
  alone_.push_back(joint);
  has_state_ |= !candidate.effect->states().empty();
  names_.push_back(name);
  return true;
}

void CandidateBatch::Close() {
  map_.emplace(model_, FindParameters(model_, names_, ""), false);
  theta_.resize(map_->size());
  for (int i = 0; i < map_->size(); ++i) {
    theta_[i] = map_->parameters()[i].nominal;
  }
}

int CandidateBatch::JointOf(const Candidate& candidate, int set,
                            int column) const {
  constexpr unsigned kElsewhere =
      kGravityHook | kLinkForceHook | kPairHook | kInputDelayHook;
  const int joint = candidate.effect->joint();
  const bool alone =
      candidate.ParameterOf(set, column) < candidate.own() && joint >= 0 &&
      (candidate.effect->hooks() & kElsewhere) == 0 && !sees_rates_ &&
      model_.followers().empty() &&
      model_.mechanism().joints[joint].type != JointType::kSpherical;
  return alone ? joint : -1;
}

// Whether one more column of such a kind can be had beside those there are.
bool CandidateBatch::GoesWith(double secant, int joint) const {
  if (IsSecant() != (secant != 0.0)) return false;
  const bool by_forces = by_ == By::kForces;
  // What acts in joints alone is quicker by itself.
  if (by_forces && (alone_.front() >= 0) != (joint >= 0)) return false;
  return secant == 0.0 ||
         (by_forces && joint >= 0 &&
          std::find(alone_.begin(), alone_.end(), joint) == alone_.end());
}

// Puts the effect into the model, off, its own parameters `at` these values;
// false where it is there with others, or another of the batch shares a
// parameter with it.
bool CandidateBatch::Admit(const Candidate& candidate,
                           const std::vector<double>& at) {
  const auto same = values_.find(candidate.effect->name());
  if (same != values_.end()) return same->second == at;
  const std::vector<std::string> names = candidate.effect->ParameterNames();
  for (const std::string& name : names) {
    if (taken_.contains(name)) return false;
  }
  try {
    model_.AddEffect(candidate.effect);
  } catch (const InputError&) {
    return false;
  }
  taken_.insert(names.begin(), names.end());
  values_[candidate.effect->name()] = at;
  for (size_t p = 0; p < at.size(); ++p) {
    model_.SetEffectParameter(candidate.parameters[p].name, at[p]);
  }
  return true;
}

std::vector<std::unique_ptr<CandidateBatch>> MakeBatches(
    const Model& fitted, const std::vector<Candidate>& candidates,
    const std::vector<CandidateSet>& sets, CandidateBatch::By by) {
  std::vector<std::unique_ptr<CandidateBatch>> batches;
  int column = 0;
  for (const CandidateSet& at : sets) {
    const Candidate& candidate = candidates[at.candidate];
    for (int i = 0; i < candidate.columns(at.set); ++i) {
      const auto takes_in = [&](const auto& batch) {
        return batch->TakeIn(candidate, at.set, i);
      };
      auto batch = std::find_if(batches.begin(), batches.end(), takes_in);
      if (batch == batches.end()) {
        batches.push_back(std::make_unique<CandidateBatch>(fitted, by));
        batch = batches.end() - 1;
        CHECK(takes_in(*batch));
      }
      (*batch)->Place(column++);
    }
  }
  for (const auto& batch : batches) batch->Close();
  return batches;
}

int CountColumns(const std::vector<Candidate>& candidates,
                 const std::vector<CandidateSet>& sets) {
  int count = 0;
  for (const CandidateSet& at : sets) {
    count += candidates[at.candidate].columns(at.set);
  }
  return count;
}

}  // namespace sysid
