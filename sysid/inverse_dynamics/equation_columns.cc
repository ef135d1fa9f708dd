#include "sysid/inverse_dynamics/equation_columns.h"

#include <algorithm>
#include <numeric>
#include <set>
#include <utility>

#include "models/effects/catalogue.h"
#include "models/error.h"

namespace sysid {
namespace {

bool Share(const Effect& a, const Effect& b) {
  const std::vector<std::string> of_a = a.ParameterNames();
  const std::vector<std::string> of_b = b.ParameterNames();
  return std::any_of(of_a.begin(), of_a.end(), [&](const std::string& name) {
    return std::find(of_b.begin(), of_b.end(), name) != of_b.end();
  });
}

bool IsSearched(const Effect& effect) {
  return std::any_of(effect.parameters().begin(), effect.parameters().end(),
                     [](const auto& p) { return !p.grid.empty() || p.whole; });
}

// Whether the effect is late: so are the filters, by what they bend, and its
// size would be that of their cut-off.
bool IsLate(const Effect& effect) {
  constexpr unsigned kLate =
      kInputDelayHook | kInputLagHook | kOwnDelayHook | kRatesHook;
  return (effect.hooks() & kLate) != 0 && (effect.hooks() & kDriveHook) == 0;
}

// The probes by which the equations may show the effect: derivatives, since of
// two laws a secant is no sum. A drive shows without its delay.
std::vector<ProbeSet> SetsOf(const Effect& effect, bool searched) {
  if (!effect.states().empty() || (searched && IsLate(effect))) return {};
  if (effect.parameters().empty()) return {{}};
  const bool is_drive = (effect.hooks() & kDriveHook) != 0;
  const bool shows = is_drive || (effect.hooks() & kPairHook) != 0;
  if (IsSearched(effect) && !searched && !shows) return {};
  std::vector<ProbeSet> sets = effect.ProbeSets();
  std::erase_if(sets, [&](const ProbeSet& probes) {
    return std::any_of(probes.begin(), probes.end(), [&](const Probe& probe) {
      for (size_t i = 0; is_drive && i < probe.at.size(); ++i) {
        if (probe.at[i] != effect.parameters()[i].null_value) return true;
      }
      return probe.secant != 0.0;
    });
  });
  return sets;
}

// Whether each weight of the probes is the change of a parameter of its own.
bool IsLinear(const Effect& effect, const ProbeSet& probes) {
  std::vector<double> weights(probes.size());
  std::iota(weights.begin(), weights.end(), 1.0);
  std::vector<double> expected =
      probes.empty() ? std::vector<double>() : probes[0].at;
  std::set<int> moved;
  for (size_t i = 0; i < probes.size(); ++i) {
    if (!moved.insert(probes[i].along).second) return false;
    expected[probes[i].along] += weights[i];
  }
  return probes.empty() || effect.FromProbes(probes, weights) == expected;
}

class Builder {
 public:
  Builder(const Model& start, const std::vector<FreeParameter>& free,
          const std::set<std::string>& known)
      : start_(start), known_(known) {
    columns_.passes.push_back({start, {}, {}, false});
    for (const FreeParameter& one : free) {
      const std::string& name = one.parameter.name;
      AddColumn(name, FindParameters(start, {name}, "effects").front().nominal,
                0);
      taken_.insert(name);
    }
    columns_.free = columns_.size();
    taken_.insert(known.begin(), known.end());
  }

  void AddCandidates(const std::shared_ptr<const Effect>& effect,
                     bool all_laws) {
    EquationColumns::Candidate candidate;
    candidate.effect = effect;
    if (!TakeOver(&candidate)) return;
    const bool reads_effort = (effect->hooks() & kReadsEffort) != 0;
    const std::vector<std::string> own = effect->ParameterNames();
    const std::vector<std::string>& nominal = effect->adjusts_nominal();
    const auto is_taken = [this](const std::string& name) {
      return taken_.contains(name);
    };
    if (std::any_of(nominal.begin(), nominal.end(), is_taken) ||
        (!all_laws &&
         (reads_effort || std::any_of(own.begin(), own.end(), is_taken)))) {
      return;
    }
    const std::vector<ProbeSet> sets = SetsOf(*effect, all_laws);
    for (const ProbeSet& probes : sets) {
      candidate.probes = probes;
      candidate.first = columns_.size();
      candidate.is_linear = IsLinear(*effect, probes);
      for (const Probe& probe : probes) {
        const std::string& name = effect->parameters()[probe.along].name;
        AddColumn(name, probe.at[probe.along],
                  PassFor(effect, probe.at, reads_effort));
      }
      for (const std::string& name : nominal) {
        AddColumn(name,
                  FindParameters(start_, {name}, "effects").front().nominal, 0);
      }
      candidate.count = columns_.size() - candidate.first;
      if (candidate.count > 0) columns_.candidates.push_back(candidate);
    }
    if (!sets.empty()) taken_.insert(own.begin(), own.end());
  }

  EquationColumns Build() {
    columns_.at = Eigen::Map<const Eigen::VectorXd>(
        at_.data(), static_cast<Eigen::Index>(at_.size()));
    for (EquationColumns::Pass& pass : columns_.passes) {
      std::vector<std::string> names;
      for (const int column : pass.columns) {
        names.push_back(columns_.names[column]);
      }
      pass.parameters = FindParameters(pass.model, names, "effects");
    }
    return std::move(columns_);
  }

 private:
  void AddColumn(const std::string& name, double at, int pass) {
    columns_.passes[pass].columns.push_back(columns_.size());
    columns_.names.push_back(name);
    at_.push_back(at);
  }

  // What the effect takes over from a law of the model; false where it is there
  // itself, or moves what is known.
  bool TakeOver(EquationColumns::Candidate* candidate) const {
    const Effect& effect = *candidate->effect;
    if (start_.effects().Contains(effect.name())) return false;
    Model model = start_;
    try {
      model.AddEffect(candidate->effect);
    } catch (const InputError&) {
      return false;  // another law of the same parameters is there
    }
    candidate->parameters =
        FindParameters(model, effect.ParameterNames(), "effects");
    bool takes_over = false;
    for (const EffectParameter& p : effect.parameters()) {
      if (known_.contains(p.name)) return false;
      const auto& before = start_.effects().parameters();
      takes_over |=
          std::any_of(before.begin(), before.end(),
                      [&](const auto& one) { return one.name == p.name; });
      for (int c = 0; c < columns_.free; ++c) {
        if (columns_.names[c] == p.name) candidate->replaces.push_back(c);
      }
    }
    for (size_t i = 0; i < effect.parameters().size(); ++i) {
      candidate->taken_over.push_back(
          takes_over ? candidate->parameters[i].nominal -
                           effect.parameters()[i].null_value
                     : 0.0);
    }
    return true;
  }

  // The first pass that can have an effect with its parameters at these values.
  int PassFor(const std::shared_ptr<const Effect>& effect,
              const std::vector<double>& at, bool reads_effort) {
    const auto count = static_cast<int>(columns_.passes.size());
    for (int i = 0; i < count; ++i) {
      EquationColumns::Pass& pass = columns_.passes[i];
      if (pass.reads_effort != reads_effort) continue;
      const Has has = HasIn(pass.model, *effect, at, i == 0);
      if (has == Has::kOther) continue;
      if (has == Has::kNothing) Put(effect, at, &pass.model);
      return i;
    }
    columns_.passes.push_back({start_, {}, {}, reads_effort});
    Put(effect, at, &columns_.passes.back().model);
    return count;
  }

  enum class Has { kIt, kNothing, kOther };
  // Whether a model has the effect at these values, nothing of its parameters,
  // or something else. The first pass has the laws of the model themselves;
  // elsewhere what takes their place may.
  Has HasIn(const Model& model, const Effect& effect,
            const std::vector<double>& at, bool first) const {
    const EffectSet& effects = model.effects();
    for (int i = 0; i < effects.size(); ++i) {
      const Effect& other = effects.effect(i);
      if (other.name() == effect.name()) {
        const double* values =
            model.nominal().effects.data() + effects.offset(i);
        return std::equal(at.begin(), at.end(), values) ? Has::kIt
                                                        : Has::kOther;
      }
      if (Share(other, effect) &&
          (first || !start_.effects().Contains(other.name()))) {
        return Has::kOther;
      }
    }
    return Has::kNothing;
  }

  static void Put(const std::shared_ptr<const Effect>& effect,
                  const std::vector<double>& at, Model* model) {
    model->AddEffect(effect);
    for (size_t i = 0; i < at.size(); ++i) {
      model->SetEffectParameter(effect->parameters()[i].name, at[i]);
    }
  }

  const Model& start_;
  const std::set<std::string>& known_;
  std::set<std::string> taken_;
  EquationColumns columns_;
  std::vector<double> at_;
};

}  // namespace

std::vector<double> EquationColumns::Values(
    const Candidate& candidate, const Eigen::VectorXd& weights) const {
  const Effect& effect = *candidate.effect;
  const size_t n = candidate.probes.size();
  std::vector<double> values;
  if (n > 0) {
    values = effect.FromProbes(candidate.probes,
                               {weights.data(), weights.data() + n});
    for (size_t i = 0; i < values.size(); ++i) {
      if (effect.parameters()[i].grid.empty()) {
        values[i] += candidate.taken_over[i];
      }
    }
  }
  for (auto i = static_cast<int>(n); i < candidate.count; ++i) {
    values.push_back(at[candidate.first + i] + weights[i]);
  }
  return values;
}

bool EquationColumns::Exclude(const Candidate& a, const Candidate& b) {
  return a.effect->name() == b.effect->name() || Share(*a.effect, *b.effect);
}

EquationColumns MakeEquationColumns(
    const Model& start, const std::vector<FreeParameter>& free,
    const std::vector<std::shared_ptr<const Effect>>& effects,
    const std::set<std::string>& known, bool all_laws) {
  // Of laws that share parameters the commoner one first, whatever the order.
  const std::vector<std::string> kinds = Catalogue().kinds();
  const auto place = [&](const Effect& effect) {
    return std::pair(std::find(kinds.begin(), kinds.end(), effect.kind()),
                     effect.name());
  };
  std::vector<std::shared_ptr<const Effect>> ordered = effects;
  std::sort(ordered.begin(), ordered.end(), [&](const auto& a, const auto& b) {
    return place(*a) < place(*b);
  });
  Builder builder(start, free, known);
  for (const auto& effect : ordered) builder.AddCandidates(effect, all_laws);
  return builder.Build();
}

}  // namespace sysid
