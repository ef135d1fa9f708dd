#include "sysid/diagnosis/formula_proposals.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "models/effects/catalogue.h"
#include "models/error.h"
#include "sysid/diagnosis/candidate_list.h"
#include "sysid/diagnosis/formula_terms.h"
#include "sysid/diagnosis/judgement_constants.h"
#include "sysid/linearization/statistics.h"

namespace sysid {
namespace {

using Values = std::map<std::string, double>;

// Numbers for names of parameters, c7, that a model has none of.
class FreeNumbers {
 public:
  explicit FreeNumbers(const Model& model) {
    for (const Parameter& p : AllParameters(model)) taken_.insert(p.name);
  }
  // For a joint the first after `after`.
  int Next(const std::string& joint, int after) const {
    for (int number = after + 1;; ++number) {
      const auto is_taken = [&](const char* letter) {
        return taken_.contains(joint + "." + letter + std::to_string(number));
      };
      if (!is_taken("c") && !is_taken("s") && !is_taken("w")) return number;
    }
  }

 private:
  std::set<std::string> taken_;
};

// Effects to search among: those of the catalogue's best set, then the terms.
struct Dictionary {
  Candidates effects;
  size_t first_term = 0;
  std::vector<FormulaTerm> terms;
  std::vector<std::string> numbers;  // of the terms' parameters

  bool IsTerm(int effect) const {
    return static_cast<size_t>(effect) >= first_term;
  }
  size_t TermAt(int effect) const { return effect - first_term; }
};

Dictionary MakeDictionary(const DiagnosisProblem& problem,
                          const EvaluatedModel& found,
                          const std::set<std::string>& joints) {
  Dictionary dictionary;
  dictionary.effects = found.added;
  dictionary.first_term = found.added.size();
  const Mechanism& mechanism = problem.model.mechanism();
  const Catalogue catalogue;
  const FreeNumbers numbers(found.fit.model);
  int number = 0;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    if (!joints.contains(joint.name) || VelocitySize(joint) != 1) continue;
    for (FormulaTerm& term : TermsOf(problem, static_cast<int>(j))) {
      const int next = numbers.Next(joint.name, number);
      const std::string text = std::to_string(next);
      try {
        dictionary.effects.push_back(
            catalogue.Make("custom@" + joint.name + ": " + TextOf(term, text),
                           mechanism, "proposals"));
      } catch (const InputError&) {
        continue;  // An input whose name no law may read.
      }
      number = next;
      dictionary.terms.push_back(std::move(term));
      dictionary.numbers.push_back(text);
    }
  }
  return dictionary;
}

// A set of the search with the terms of each joint as one formula.
struct Merged {
  Candidates effects;
  size_t beside = 0;  // how many of those are the catalogue's
  std::set<std::string> without_influence;
  Values values;
};

Merged Merge(const DiagnosisProblem& problem, const Dictionary& dictionary,
             const FittedSet& fitted) {
  const FreeNumbers free(problem.model);
  Merged merged;
  merged.values = ValuesOf(fitted.model);
  merged.without_influence = fitted.model.without_influence;
  std::vector<std::string> joints;
  std::map<std::string, std::string> texts;
  std::map<std::string, int> numbers;
  for (const int e : fitted.effects) {
    if (!dictionary.IsTerm(e)) {
      merged.effects.push_back(dictionary.effects[e]);
      continue;
    }
    const FormulaTerm& term = dictionary.terms[dictionary.TermAt(e)];
    const std::string& before = dictionary.numbers[dictionary.TermAt(e)];
    int& number = numbers[term.joint];
    number = free.Next(term.joint, number);
    const std::string now = std::to_string(number);
    std::string& text = texts[term.joint];
    if (text.empty()) joints.push_back(term.joint);
    text += (text.empty() ? "" : " + ") + TextOf(term, now);
    for (const std::string letter : {"c", "s", "w"}) {
      const std::string from = term.joint + "." + letter + before;
      const std::string to = term.joint + "." + letter + now;
      if (merged.without_influence.erase(from) > 0) {
        merged.without_influence.insert(to);
      }
      auto value = merged.values.extract(from);
      if (value.empty()) continue;
      value.key() = to + "!";
      merged.values.insert(std::move(value));
    }
  }
  // New names may be old ones of other terms.
  Values values;
  for (const auto& [name, value] : merged.values) {
    if (name.ends_with("!")) values[name.substr(0, name.size() - 1)] = value;
  }
  for (const auto& [name, value] : merged.values) values.emplace(name, value);
  merged.values = std::move(values);
  merged.beside = merged.effects.size();
  const Catalogue catalogue;
  for (const std::string& joint : joints) {
    merged.effects.push_back(
        catalogue.Make("custom@" + joint + ": " + texts[joint],
                       problem.model.mechanism(), "proposals"));
  }
  return merged;
}

// What it replaces of the catalogue's set.
std::vector<std::string> ReplacedBy(const FittedSet& fitted,
                                    const Dictionary& dictionary) {
  std::set<std::string> smoothed;  // joints
  for (const int e : fitted.effects) {
    if (!dictionary.IsTerm(e)) continue;
    const FormulaTerm& term = dictionary.terms[dictionary.TermAt(e)];
    if (IsSmoothSign(term)) smoothed.insert(term.joint);
  }
  std::vector<std::string> replaced;
  for (size_t i = 0; i < dictionary.first_term; ++i) {
    const Effect& effect = *dictionary.effects[i];
    const bool stays = std::find(fitted.effects.begin(), fitted.effects.end(),
                                 static_cast<int>(i)) != fitted.effects.end();
    const bool is_smoothed = (effect.hooks() & kDryFrictionHook) != 0 &&
                             smoothed.contains(effect.target());
    if (!stays && !is_smoothed) replaced.push_back(effect.name());
  }
  return replaced;
}

FormulaProposal Describe(const EvaluatedModel& model, const Merged& merged) {
  FormulaProposal proposal;
  std::vector<const Effect*> laws;
  for (size_t i = 0; i < merged.effects.size(); ++i) {
    const Effect& effect = *merged.effects[i];
    (i < merged.beside ? proposal.beside : proposal.laws)
        .push_back(effect.name());
    if (i >= merged.beside) laws.push_back(&effect);
  }
  proposal.parameters = EstimatesOf(model, laws);
  proposal.cv_error = model.cv.error();
  proposal.holdout = model.holdout_error();
  proposal.segment_s = model.fit.segment_s;
  return proposal;
}

}  // namespace

std::vector<std::string> FormulaProposal::effects() const {
  std::vector<std::string> all = laws;
  all.insert(all.end(), beside.begin(), beside.end());
  return all;
}

std::vector<FormulaProposal> ProposeFormulas(
    const DiagnosisProblem& problem, const EvaluatedModel& found,
    const std::set<std::string>& joints, int candidates,
    const ReportDoing& report) {
  std::vector<FormulaProposal> proposals;
  const Dictionary dictionary = MakeDictionary(problem, found, joints);
  if (dictionary.terms.empty()) return proposals;
  EffectSearch search(problem, dictionary.effects, report);
  // From the model as given, as the catalogue's set may stand in for a law;
  // from that set where it is more than one look adds.
  std::vector<int> start(dictionary.first_term > kDepth ? dictionary.first_term
                                                        : 0);
  std::iota(start.begin(), start.end(), 0);
  const EffectSearch::Answer answer =
      search.Run(start, EffectSearch::Equations::kBegin, kMostFitsOfFormulas);
  if (!answer.explains) return proposals;
  const double deviations =
      Deviations(candidates + static_cast<int>(dictionary.terms.size()));
  std::vector<std::shared_ptr<const FittedSet>> sets = {answer.found};
  sets.insert(sets.end(), answer.rivals.begin(), answer.rivals.end());
  for (const auto& fitted : sets) {
    const auto terms =
        std::count_if(fitted->effects.begin(), fitted->effects.end(),
                      [&](int e) { return dictionary.IsTerm(e); });
    if (terms == 0 || terms > kDepth) continue;
    const Merged merged = Merge(problem, dictionary, *fitted);
    report("fitting " + merged.effects.back()->name(), fitted->error());
    const EvaluatedModel model = EvaluateFrom(
        problem, fitted->model, merged.effects, merged.without_influence,
        {merged.values}, 0.0, problem.options);
    const EvaluatedModel by_catalogue = EvaluateOver(problem, found, model);
    if (!Beats(ScoreOf(model), ScoreOf(by_catalogue), deviations)) continue;
    proposals.push_back(Describe(model, merged));
    proposals.back().replaces = ReplacedBy(*fitted, dictionary);
  }
  // The answer of the search stays the first: rivals have errors as small.
  std::stable_sort(
      proposals.begin() + (proposals.empty() ? 0 : 1), proposals.end(),
      [](const auto& a, const auto& b) { return a.cv_error < b.cv_error; });
  return proposals;
}

}  // namespace sysid
