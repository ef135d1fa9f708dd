#include "sysid/report/text.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "models/error.h"
#include "models/printable.h"

namespace sysid {
namespace {

// What the equations of motion determine: "link2.Jyy + 0.0506 link3.m + 4
// more".
std::string BaseName(const BaseParameter& base) {
  constexpr size_t kShown = 4;
  std::string name = base.terms[0].name;
  for (size_t i = 1; i < std::min(base.terms.size(), kShown); ++i) {
    const double factor = base.terms[i].factor;
    name += factor < 0 ? " - " : " + ";
    if (std::abs(std::abs(factor) - 1.0) > 1e-4) {
      name += Format("%.3g ", std::abs(factor));
    }
    name += base.terms[i].name;
  }
  if (base.terms.size() > kShown) {
    name += Format(" + %d more", static_cast<int>(base.terms.size() - kShown));
  }
  return name;
}

// Median and worst of the open predictions, and whose the worst is.
std::string OpenSummary(const std::vector<OpenError>& open,
                        const std::string& kind) {
  struct Channel {
    std::string name, unit;
    std::vector<std::pair<double, std::string>> rms;  // and run
  };
  std::vector<Channel> channels;
  for (const OpenError& run : open) {
    for (const OpenError::Channel& channel : run.channels) {
      auto at = std::find_if(
          channels.begin(), channels.end(),
          [&](const Channel& c) { return c.name == channel.name; });
      if (at == channels.end()) {
        at = channels.insert(at, {channel.name, channel.unit, {}});
      }
      at->rms.emplace_back(channel.rms, Printable(run.trajectory));
    }
  }
  std::string text =
      Format("  open prediction of %d ", static_cast<int>(open.size())) + kind +
      "runs, each from one initial state:";
  for (Channel& channel : channels) {
    auto& rms = channel.rms;
    const auto [worst, run] = *std::max_element(rms.begin(), rms.end());
    const auto middle = rms.begin() + (rms.size() - 1) / 2;
    std::nth_element(rms.begin(), middle, rms.end());
    const auto value = [&](double x) {
      return std::isfinite(x) ? Format("%.3g ", x) + channel.unit : "diverges";
    };
    text += " " + channel.name + " median " + value(middle->first) +
            ", worst " + value(worst) + " (" + run + ");";
  }
  text.back() = '\n';
  return text;
}

}  // namespace

std::string Times(double error) {
  if (!(error >= 999.5) || error >= 1e9) return Format("%.3g", error);
  const double unit = std::pow(10.0, std::floor(std::log10(error)) - 2.0);
  return Format("%.0f", std::round(error / unit) * unit);
}

std::string Paint(bool colour, const char* code, const std::string& text) {
  return colour ? code + text + "\033[0m" : text;
}

std::string CommonUnit(const std::vector<ChannelError>& channels) {
  std::string unit;
  for (const ChannelError& channel : channels) {
    if (!channel.position_like) continue;
    if (!unit.empty() && unit != channel.unit) return "";
    unit = channel.unit;
  }
  return unit;
}

std::string ErrorWords(const ErrorSummary& error, const std::string& unit) {
  const std::string share = OfTheMotion(error.fit_percent);
  const std::string beside = Times(error.normalized_rms) + " times the noise";
  return unit.empty()
             ? beside + share
             : Format("%.3g ", error.rms) + unit + share + ", " + beside;
}

std::string ErrorWords(const RunErrors& errors) {
  return ErrorWords(errors.total, CommonUnit(errors.channels));
}

std::string Probability(double p) {
  if (std::isnan(p)) return "-";
  return p < 1e-12 ? "<1e-12" : Format("%.2g", p);
}

std::string Behind(const std::string& unit) {
  return unit == "-" ? "" : " " + unit;
}

// As many digits as the standard error makes meaningful, and two more.
std::string Value(double value, double std_error) {
  if (!std::isfinite(value)) return "-";
  int digits = 6;
  if (std_error > 0 && value != 0) {
    digits = static_cast<int>(std::ceil(std::log10(std::abs(value)) -
                                        std::log10(std_error))) +
             2;
    digits = std::clamp(digits, 2, 12);
  }
  return Format("%.*g", digits, value);
}

std::string SegmentLengths(const Fit& fit) {
  constexpr double kAlike = 1.05;  // a sample more or less is no difference
  double least = fit.segment_s, most = fit.segment_s;
  for (const SegmentError& segment : fit.train.segments) {
    least = std::min(least, segment.t_end - segment.t_start);
    most = std::max(most, segment.t_end - segment.t_start);
  }
  if (most <= kAlike * least) return Format("%.3g s", fit.segment_s);
  return Format("%.3g to %.3g s", least, most);
}

std::string OfTheMotion(double fit_percent) {
  if (!std::isfinite(fit_percent)) return "";
  // 99.97 is not 100.
  const double missing = 100.0 - fit_percent;
  const int decimals = missing > 0.0 && missing < 0.05
                           ? static_cast<int>(-std::floor(std::log10(missing)))
                           : 0;
  return decimals > 0 && decimals < 6
             ? Format(" (fit %.*f %%)", decimals, fit_percent)
             : Format(" (fit %.3g %%)", fit_percent);
}

std::string OpenLines(const std::vector<OpenError>& open,
                      const std::string& kind) {
  constexpr size_t kMostRuns = 12;  // what a reader takes in one by one
  if (open.size() > kMostRuns) return OpenSummary(open, kind);
  std::string text;
  for (const OpenError& run : open) {
    text += "  open prediction of " + kind + Printable(run.trajectory) +
            Format(", %.4g s from one initial state:", run.duration_s);
    for (const OpenError::Channel& channel : run.channels) {
      text += " " + channel.name +
              (std::isfinite(channel.rms) ? Format(" %.3g ", channel.rms)
                                          : std::string(" diverges ")) +
              channel.unit + OfTheMotion(channel.fit_percent) + ",";
    }
    if (text.back() == ',') text.back() = '\n';
  }
  return text;
}

std::string ListEffects(const std::vector<std::string>& names,
                        const char* between) {
  constexpr size_t kMost = 3;
  if (names.size() <= kMost) return Join(names, between);
  std::vector<std::string> kinds;
  std::map<std::string, std::vector<std::string>> targets;
  for (const std::string& name : names) {
    const size_t at = name.find('@');
    const std::string kind = name.substr(0, at);
    if (!targets.contains(kind)) kinds.push_back(kind);
    targets[kind].push_back(at == std::string::npos ? "" : name.substr(at + 1));
  }
  for (std::string& kind : kinds) {
    kind += " (" + Join(targets[kind], ", ") + ")";
  }
  return Join(kinds, ", ");
}

bool ShowsCombinations(const Fit& fit) {
  return !fit.not_identifiable.empty() &&
         std::any_of(fit.base.begin(), fit.base.end(),
                     [](const BaseParameter& b) { return b.terms.size() > 1; });
}

std::string BaseTable(const Fit& fit) {
  struct Row {
    std::string name;
    double value, std_error;
    std::string unit;
  };
  std::vector<Row> rows;
  std::set<std::string> in_terms;
  for (const BaseParameter& base : fit.base) {
    rows.push_back({BaseName(base), base.value, base.std_error, base.unit});
    for (const BaseParameter::Term& term : base.terms) {
      in_terms.insert(term.name);
    }
  }
  // What the equations of motion do not show, but the trajectories: a delay.
  std::set<std::string> of_effects;
  for (const EffectParameter& p : fit.model.effects().parameters()) {
    of_effects.insert(p.name);
  }
  for (const ParameterEstimate& p : fit.parameters) {
    if (!p.identifiable || in_terms.contains(p.name)) continue;
    if (of_effects.contains(p.name)) {
      rows.push_back({p.name, p.value, p.std_error,
                      p.unit + (p.at_bound ? "  at its bound" : "")});
    }
  }
  size_t width = 0;
  for (const Row& row : rows) width = std::max(width, row.name.size());
  std::string text = Format("  %-*s %16s %12s  %s\n", static_cast<int>(width),
                            "base parameter", "value", "+- (95 %)", "unit");
  for (const Row& row : rows) {
    text += Format("  %-*s %16s %12s  ", static_cast<int>(width),
                   row.name.c_str(), Value(row.value, row.std_error).c_str(),
                   std::isfinite(row.std_error)
                       ? Format("%.2g", 1.959964 * row.std_error).c_str()
                       : "-") +
            row.unit + "\n";
  }
  return text + "\n";
}

std::string EffortLine(const std::string& label,
                       const std::vector<EffortError>& efforts,
                       double cut_off_hz) {
  if (efforts.empty()) return "";
  std::string text = label + "inverse-dynamics residual, % of the rms effort:";
  for (const EffortError& effort : efforts) {
    text += " " + effort.joint + Format(" %.3g,", effort.percent);
  }
  text.pop_back();
  return text +
         (cut_off_hz > 0.0 ? Format(" (up to %.2g Hz)\n", cut_off_hz) : "\n");
}

}  // namespace sysid
