#include "sysid/session/session.h"

#include <algorithm>
#include <filesystem>

#include "models/error.h"
#include "models/find_model.h"
#include "models/urdf/load_urdf.h"
#include "sysid/io/csv.h"
#include "sysid/io/read_run.h"
#include "sysid/io/run_rows.h"
#include "sysid/session/check_runs.h"
#include "sysid/session/effect_inputs.h"
#include "sysid/session/free_choice.h"
#include "sysid/session/law_values.h"
#include "sysid/session/locks.h"
#include "sysid/session/named_values.h"
#include "sysid/session/session_options.h"
#include "sysid/session/shared_runs.h"
#include "sysid/session/table_range.h"

namespace sysid {
namespace {

// The first sentences of many.
std::string JoinFew(std::vector<std::string> sentences) {
  constexpr size_t kFew = 5;
  const size_t count = sentences.size();
  if (count > kFew) {
    sentences.resize(kFew);
    sentences.push_back("and " + std::to_string(count - kFew) + " more");
  }
  return Join(sentences, "; ");
}

// "--traj: 8 processes share out the runs by size: 25, 25, ...".
std::string ShareNotice(const Processes& all,
                        const std::vector<std::string>& own,
                        const std::string& flag) {
  std::vector<double> counts(all.size(), 0.0);
  counts[all.rank()] = static_cast<double>(own.size());
  all.Max(&counts);
  const auto [least, most] = std::minmax_element(counts.begin(), counts.end());
  return flag + ": " + std::to_string(all.size()) +
         " processes share out the runs by size, " + ShortestText(*least) +
         " to " + ShortestText(*most) + " each";
}

// The specification of --spec, or the one beside the model.
FitSpecification ReadSpecification(const FitRequest& request) {
  if (!request.spec.empty()) return ReadFitSpecification(request.spec);
  if (request.model.empty()) return {};
  const std::filesystem::path urdf = FindModel(request.model);
  std::filesystem::path beside = urdf;
  beside.replace_extension(".sysid.yaml");
  if (!std::filesystem::exists(beside)) return {};
  return ReadFitSpecification(beside.string());
}

// That a specification's model, where it is a name, is there: FindModel would
// blame the flag.
void CheckShipped(const Located<std::string>& model) {
  try {
    FindModel(model.value);
  } catch (const InputError& error) {
    throw InputError(model.place,
                     "no shipped model is named '" + model.value + "'",
                     error.hint());
  }
}

// What reading some files came to.
struct ReadFiles {
  std::vector<Run> runs;
  std::vector<std::string> notices;
  std::vector<std::string> skipped, reasons, hints;  // of bad ones
};

ReadFiles ReadThese(const std::vector<std::string>& files, bool skip,
                    const Session& session) {
  ReadFiles read;
  for (const std::string& file : files) {
    if (!skip) {
      read.runs.push_back(ReadSessionRun(session, file, &read.notices));
      continue;
    }
    std::vector<std::string> own;
    try {
      read.runs.push_back(ReadGoodRun(session, file, &own));
      read.notices.insert(read.notices.end(), own.begin(), own.end());
    } catch (const InputError& error) {
      read.skipped.push_back(file);
      read.reasons.push_back(error.WithoutHint());
      read.hints.push_back(error.hint());
    }
  }
  return read;
}

// Of runs that may be read wrong a reader wants to know first: their notices
// stand before those of the model. With `skip`, bad runs are set aside; throws
// InputError where that leaves none of those that `flag` names. Each process
// reads its own, and knows what was said of all.
std::vector<Run> ReadRuns(const std::vector<std::string>& files,
                          const std::string& flag, bool skip, Session* session,
                          std::vector<std::string>* notices) {
  const Processes& all = ProcessesOf(session->options);
  const std::vector<std::string> own = OwnFiles(all, files);
  ReadFiles read;
  DoAlike(all, [&] { read = ReadThese(own, skip, *session); });
  // What was said of one run is not said again of the next.
  for (const std::string& notice : JoinLists(all, read.notices)) {
    if (std::find(notices->begin(), notices->end(), notice) == notices->end()) {
      notices->push_back(notice);
    }
  }
  const std::vector<std::string> skipped = JoinLists(all, read.skipped);
  const std::vector<std::string> reasons = JoinLists(all, read.reasons);
  for (size_t i = 0; i < skipped.size(); ++i) {
    session->skipped_runs.push_back({skipped[i], reasons[i]});
  }
  if (skipped.size() == files.size() && !files.empty()) {
    const std::string hint = JoinLists(all, read.hints).front();
    throw InputError(flag,
                     "no run is left: each of " + CountOf(files.size(), "run") +
                         " is bad: " + JoinFew(reasons),
                     hint.empty() ? "run sysid_check on one of them" : hint);
  }
  if (all.size() > 1 && !files.empty()) {
    notices->push_back(ShareNotice(all, own, flag));
  }
  return std::move(read.runs);
}

// What was set aside, in a line; all of it is in the JSON.
void NoteSkipped(const Session& session, size_t asked,
                 std::vector<std::string>* notices) {
  if (session.skipped_runs.empty()) return;
  std::vector<std::string> reasons;
  for (const SkippedRun& run : session.skipped_runs) {
    reasons.push_back(run.reason.starts_with(run.run)
                          ? run.reason
                          : run.run + ": " + run.reason);
  }
  notices->insert(notices->begin(), "--skip_bad_runs: set aside " +
                                        std::to_string(reasons.size()) +
                                        " of " + CountOf(asked, "run") + ": " +
                                        JoinFew(reasons));
}

// Of joints that no run drives while others are driven: that may be so, or
// their efforts were not recorded. Joints that a machine leaves passive are few
// and have no motor, whose effort a URDF would limit.
void NotePassive(const std::vector<const Run*>& runs,
                 const Mechanism& mechanism,
                 std::vector<std::string>* notices) {
  std::vector<std::string> driven, passive, columns;
  bool has_motor = false;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    const int size = VelocitySize(joint);
    if (size == 0) continue;
    const bool is_driven =
        std::any_of(runs.begin(), runs.end(), [&](const Run* run) {
          return !run->effort.middleCols(joint.v_index, size).isZero(0.0);
        });
    // Of one without any column UnmeasuredNotice speaks.
    const bool is_measured =
        std::any_of(runs.begin(), runs.end(), [&](const Run* run) {
          return std::any_of(run->channels.begin(), run->channels.end(),
                             [&](const Channel& channel) {
                               return channel.kind !=
                                          ChannelKind::kFramePosition &&
                                      channel.target == static_cast<int>(j);
                             });
        });
    if (!is_driven && !is_measured) continue;
    (is_driven ? driven : passive).push_back(joint.name);
    if (is_driven) continue;
    columns.push_back(joint.name + (size == 1 ? ".tau" : ".taux"));
    has_motor |= joint.effort_limit > 0.0;
  }
  if (driven.empty() || passive.empty()) return;
  if (!has_motor && driven.size() <= passive.size()) return;
  notices->push_back("no effort is recorded of " + Join(passive) + ", but of " +
                     Join(driven) +
                     ": right only if no motor acts there; else map the "
                     "columns " +
                     Join(columns));
}

// A joint that one run drives and another does not: that may be so, or its
// efforts were not recorded.
void NoteUndriven(const std::vector<const Run*>& all,
                  const Mechanism& mechanism,
                  std::vector<std::string>* notices) {
  for (const Joint& joint : mechanism.joints) {
    const auto driven = [&](const Run* run) {
      return !run->effort.middleCols(joint.v_index, VelocitySize(joint))
                  .isZero(0.0);
    };
    if (std::none_of(all.begin(), all.end(), driven)) continue;
    for (const Run* run : all) {
      if (driven(run)) continue;
      notices->push_back(run->name + ": no effort acts on joint '" +
                         joint.name +
                         "', as it does in other runs: right only if it was "
                         "not driven there");
    }
  }
}

}  // namespace

Model OpenModel(const std::string& name_or_file, const Catalogue& catalogue,
                std::vector<NamedValue>* locks, std::string* file,
                std::vector<std::string>* notices, const ColumnMap& columns) {
  *file = FindModel(name_or_file);
  Mechanism mechanism = LoadUrdf(*file);
  mechanism.inputs = OwnInputs(columns, mechanism);
  *locks = ResolveLocks(mechanism, *locks);
  mechanism = LockJoints(mechanism, *locks, notices);
  Model model = MakeModel(mechanism, catalogue);
  for (const Joint& joint : mechanism.joints) {
    if (joint.held) continue;
    if (joint.damping > 0.0) {
      notices->push_back("joint '" + joint.name + "': <dynamics> damping " +
                         ShortestText(joint.damping) +
                         " is in the model as viscous_damping");
    }
    if (joint.friction > 0.0) {
      notices->push_back("joint '" + joint.name + "': <dynamics> friction " +
                         ShortestText(joint.friction) +
                         " is in the model as coulomb_friction");
    }
  }
  return model;
}

Run ReadSessionRun(const Session& session, const std::string& file,
                   std::vector<std::string>* notices) {
  const Mechanism& mechanism = session.model.mechanism();
  Run run = ReadRun(file, session.columns, mechanism, notices);
  ApplyEdits(session.edits, mechanism, &run, notices);
  if (!session.edits.ignored.empty()) {
    DropUnmeasured(session.edits.ignored.front().place, &run, notices);
    BeginMeasured(&run, notices);
  }
  return run;
}

Run ReadGoodRun(const Session& session, const std::string& file,
                std::vector<std::string>* notices) {
  Run run = ReadSessionRun(session, file, notices);
  CheckTimes({run});
  const EffectSet& effects = session.model.effects();
  for (int i = 0; i < effects.size(); ++i) {
    const EffectInput* missing = MissingInput(effects.effect(i), run);
    if (missing == nullptr) continue;
    throw InputError(file, effects.effect(i).name() + " reads " +
                               missing->name + ", which is not there");
  }
  return run;
}

namespace {

// The model's name or file, by the flag or else by the specification.
std::string WantedModel(const FitRequest& request,
                        const FitSpecification& spec) {
  if (!request.model.empty()) return request.model;
  if (!spec.model) {
    throw InputError(
        "--model", "is missing",
        "give a URDF file or a shipped model: " + Join(ShippedModels()));
  }
  return spec.model->value;
}

void CheckFiles(const FitRequest& request) {
  if (request.traj.empty()) {
    throw InputError("--traj", "is missing",
                     "give the recordings to fit: --traj run1.csv,run2.csv");
  }
  CheckDistinct(request.traj, request.holdout);
}

// How the runs are to be read.
void FillReading(const FitRequest& request, const FitSpecification& spec,
                 Session* session) {
  const Mechanism& mechanism = session->model.mechanism();
  session->flag_columns = ParseColumnMap(request.columns);
  session->columns = MergeByName(spec.columns, session->flag_columns);
  session->flag_edits = {ParseShifts(request.shift, "--shift"),
                         ParseIgnored(request.ignore, "--ignore")};
  session->edits = MergeEdits(spec.edits, session->flag_edits, mechanism);
  CheckEdits(session->edits, mechanism);
  std::vector<std::string> files = request.traj;
  files.insert(files.end(), request.holdout.begin(), request.holdout.end());
  CheckRunNames(session->flag_columns, session->flag_edits, mechanism, files);
}

// What the laws read that flags and specification type.
ColumnMap LawInputs(const FitRequest& request, const FitSpecification& spec,
                    const std::string& model) {
  std::vector<std::string> laws = SplitEffects(request.add, "--add");
  for (const std::string& effect :
       SplitEffects(request.candidates, "--candidates")) {
    laws.push_back(effect);
  }
  for (const auto& effect : spec.effects) laws.push_back(effect.value);
  std::erase_if(laws, [](const std::string& effect) {
    return effect.find(':') == std::string::npos;
  });
  if (laws.empty()) return {};
  std::vector<std::string> files = request.traj;
  files.insert(files.end(), request.holdout.begin(), request.holdout.end());
  return InputsOfLaws(laws, files, LoadUrdf(model));
}

// All but the runs and what depends on them.
Session OpenWithoutRuns(const FitRequest& request, const FitSpecification& spec,
                        const Catalogue& catalogue) {
  const std::string wanted = WantedModel(request, spec);
  CheckFiles(request);
  if (request.model.empty()) CheckShipped(*spec.model);
  std::string file;
  std::vector<std::string> notices;
  const std::vector<NamedValue> flag_locks =
      SplitAssignments(request.lock, "--lock");
  std::vector<NamedValue> locks = spec.lock;
  locks.insert(locks.end(), flag_locks.begin(), flag_locks.end());
  ColumnMap columns =
      MergeByName(spec.columns, ParseColumnMap(request.columns));
  for (ColumnMapping& input : LawInputs(request, spec, FindModel(wanted))) {
    columns.push_back(std::move(input));
  }
  Session session(
      OpenModel(wanted, catalogue, &locks, &file, &notices, columns));
  session.locked = locks;
  session.flag_locks = flag_locks;
  session.spec_file = spec.path;
  session.model_file = file;
  session.model_name = std::filesystem::path(file).stem().string();
  session.options.processes = request.processes;
  session.notices = notices;
  ChooseFree(request,
             WithoutHeld(session.model.mechanism(), spec, &session.notices),
             catalogue, &session);
  FillOptions(request, spec, &session);
  FillReading(request, spec, &session);
  return session;
}

}  // namespace

Session OpenModelSession(const FitRequest& request,
                         const Catalogue& catalogue) {
  return OpenWithoutRuns(request, ReadSpecification(request), catalogue);
}

Session OpenSession(const FitRequest& request, const Catalogue& catalogue) {
  const FitSpecification spec = ReadSpecification(request);
  Session session = OpenWithoutRuns(request, spec, catalogue);
  std::vector<std::string> read;
  const bool skip = request.skip_bad_runs;
  session.runs = ReadRuns(request.traj, "--traj", skip, &session, &read);
  session.holdout =
      ReadRuns(request.holdout, "--holdout", skip, &session, &read);
  const Mechanism& mechanism = session.model.mechanism();
  const Processes& processes = ProcessesOf(session.options);
  DoAlike(processes, [&] { CheckTimes(session.runs); });
  std::vector<Run> outlines = OutlinesOfAll(processes, session.runs);
  CheckMotion(outlines);
  DoAlike(processes, [&] { CheckTimes(session.holdout); });
  for (Run& run : OutlinesOfAll(processes, session.holdout)) {
    outlines.push_back(std::move(run));
  }
  std::vector<const Run*> all;
  for (const Run& run : outlines) {
    all.push_back(&run);
    session.run_names.push_back(run.name);
  }
  NotePassive(all, mechanism, &read);
  NoteSkipped(session, request.traj.size() + request.holdout.size(), &read);
  session.notices.insert(session.notices.begin(), read.begin(), read.end());
  NoteUndriven(all, mechanism, &session.notices);
  for (int i = 0; i < session.model.effects().size(); ++i) {
    CheckCanRead(session.model.effects().effect(i), all, "--add");
  }
  DoAlike(processes, [&] {
    for (int i = 0; i < session.model.effects().size(); ++i) {
      CheckHasValues(session.model.effects().effect(i), mechanism,
                     AllRunsOf(session), "--add");
    }
  });
  const std::string unmeasured =
      UnmeasuredNotice(mechanism, all, session.flag_locks);
  if (!unmeasured.empty()) session.notices.push_back(unmeasured);
  FillLengths(request, spec, &session);
  CoverTables(&session);
  return session;
}

}  // namespace sysid
