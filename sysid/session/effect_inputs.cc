#include "sysid/session/effect_inputs.h"

#include <algorithm>
#include <cctype>
#include <cstring>

#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/read_run.h"
#include "sysid/io/run_columns.h"

namespace sysid {

const EffectInput* MissingInput(const Effect& effect, const Run& run) {
  for (const EffectInput& input : effect.inputs()) {
    if (!HasInput(run, input.name)) return &input;
  }
  return nullptr;
}

ColumnMap InputsOfLaws(const std::vector<std::string>& effects,
                       const std::vector<std::string>& files,
                       const Mechanism& mechanism) {
  const auto is_part = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.';
  };
  std::vector<std::string> words;
  for (const std::string& effect : effects) {
    const size_t size = effect.size();
    for (size_t i = std::min(effect.find(':'), size), end; i < size; i = end) {
      end = i;
      while (end < size && is_part(effect[end])) ++end;
      words.push_back(effect.substr(i, end - i));
      end = std::max(end, i + 1);
    }
  }
  ColumnMap inputs;
  for (const std::string& file : files) {
    try {
      for (const ColumnMapping& column : OwnInputColumns(file, mechanism)) {
        if (Contains(words, column.name)) inputs.push_back(column);
      }
    } catch (const InputError&) {
      // Said where it is read.
    }
  }
  return inputs;
}

bool MeasureMotor(const std::vector<const Run*>& runs, int joint) {
  return std::any_of(runs.begin(), runs.end(), [&](const Run* run) {
    return FindChannel(*run, ChannelKind::kMotorPosition, joint) != nullptr;
  });
}

bool MeasureBothEnds(const std::vector<const Run*>& runs, int joint) {
  return std::any_of(runs.begin(), runs.end(), [&](const Run* run) {
    return FindChannel(*run, ChannelKind::kMotorPosition, joint) != nullptr &&
           FindChannel(*run, ChannelKind::kPosition, joint) != nullptr;
  });
}

void CheckCanRead(const Effect& effect, const std::vector<const Run*>& runs,
                  const std::string& place) {
  for (const Run* run : runs) {
    const EffectInput* missing = MissingInput(effect, *run);
    if (missing == nullptr) continue;
    const std::string& column = missing->name;
    throw InputError(place,
                     effect.name() + " reads " + column + " of " + run->name +
                         ", which is not there",
                     "record the column " + column +
                         ", or map one to it: --columns " + column + "=COLUMN");
  }
  if (effect.on_motor() && !MeasureMotor(runs, effect.joint())) {
    const std::string& motor = effect.target();
    const std::string column =
        motor.substr(0, motor.size() - std::strlen(kOfMotor)) + ".motor_q";
    throw InputError(
        place,
        effect.name() + " is of the column " + column + ", which no run has",
        "record the column, or map one to it: --columns " + column + "=COLUMN");
  }
}

bool CanRead(const Effect& effect, const std::vector<const Run*>& runs) {
  return std::all_of(runs.begin(), runs.end(),
                     [&](const Run* run) {
                       return MissingInput(effect, *run) == nullptr;
                     }) &&
         (!effect.on_motor() || MeasureMotor(runs, effect.joint()));
}

std::vector<const Run*> AllRunsOf(const Session& session) {
  std::vector<const Run*> runs;
  for (const Run& run : session.runs) runs.push_back(&run);
  for (const Run& run : session.holdout) runs.push_back(&run);
  return runs;
}

}  // namespace sysid
