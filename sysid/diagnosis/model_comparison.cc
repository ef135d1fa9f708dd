#include "sysid/diagnosis/model_comparison.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace sysid {
namespace {

// What the one has and the other does not.
std::vector<std::string> Minus(const std::vector<std::string>& one,
                               const std::vector<std::string>& other) {
  const std::set<std::string> a(one.begin(), one.end());
  const std::set<std::string> b(other.begin(), other.end());
  std::vector<std::string> rest;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(),
                      std::back_inserter(rest));
  return rest;
}

}  // namespace

ModelErrors ErrorsOf(const EvaluatedModel& evaluated) {
  ModelErrors errors;
  for (const auto& effect : evaluated.added) {
    errors.effects.push_back(effect->name());
  }
  errors.segment_s = evaluated.fit.segment_s;
  errors.train = evaluated.fit.train.total;
  errors.holdout = evaluated.holdout.total;
  errors.cv = evaluated.cv;
  return errors;
}

ModelErrors ErrorsOver(const DiagnosisProblem& problem,
                       const EvaluatedModel& evaluated,
                       const EvaluatedModel& final) {
  if (evaluated.fit.segment_s == final.fit.segment_s) {
    return ErrorsOf(evaluated);
  }
  return ErrorsOf(EvaluateOver(problem, evaluated, final));
}

void SetNeighbours(const std::vector<ModelErrors>& tried,
                   const EvaluatedModel& final, ModelComparison* comparison) {
  const std::vector<std::string> effects = ErrorsOf(final).effects;
  for (const ModelErrors& model : tried) {
    if (model.segment_s != final.fit.segment_s) continue;
    const std::vector<std::string> more = Minus(model.effects, effects);
    const std::vector<std::string> less = Minus(effects, model.effects);
    if (more.empty() && less.size() == 1) {
      comparison->left_out.push_back(model);
      comparison->left_out.back().change = less[0];
    } else if (less.empty() && more.size() == 1) {
      comparison->added.push_back(model);
      comparison->added.back().change = more[0];
    }
  }
  std::stable_sort(comparison->added.begin(), comparison->added.end(),
                   [](const ModelErrors& a, const ModelErrors& b) {
                     return a.cv.error() < b.cv.error();
                   });
}

}  // namespace sysid
