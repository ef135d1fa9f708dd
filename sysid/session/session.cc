#include "sysid/session/session.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <set>

#include "models/error.h"
#include "models/find_model.h"
#include "models/urdf/load_urdf.h"
#include "sysid/io/cell.h"
#include "sysid/io/csv.h"
#include "sysid/io/read_run.h"
#include "sysid/session/check_runs.h"
#include "sysid/session/edit_run.h"
#include "sysid/session/effect_inputs.h"
#include "sysid/session/effort_notices.h"
#include "sysid/session/free_choice.h"
#include "sysid/session/law_values.h"
#include "sysid/session/locks.h"
#include "sysid/session/named_values.h"
#include "sysid/session/session_options.h"
#include "sysid/session/shared_runs.h"
#include "sysid/session/table_range.h"
#include "sysid/session/unshown_joints.h"

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
  if (request.model.empty() || request.model_in_memory) return {};
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

// Runs of a mechanism that are in memory, as the session's locks, shifts and
// ignored spans make them, at the end of `to`.
void TakeRuns(std::vector<Run> runs, const Mechanism& mechanism,
              const Session& session, std::vector<Run>* to,
              std::vector<std::string>* notices) {
  for (Run& run : runs) {
    if (run.effort.size() == 0) {
      run.effort.setZero(run.size(), mechanism.nv);
      run.recorded_efforts.assign(mechanism.nv, false);
    }
    CheckShape(run, mechanism);
    DropHeldChannels(mechanism, session.model.mechanism(), &run);
    EditRun(session, &run, notices);
    to->push_back(std::move(run));
  }
}

// Gives those in memory that have no name one.
void NameRuns(FitRequest* request) {
  int number = 0;
  for (auto* runs : {&request->runs, &request->holdout_runs}) {
    for (Run& run : *runs) {
      ++number;
      if (run.name.empty()) run.name = "run " + std::to_string(number);
    }
  }
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

// What a URDF's <dynamics> put into the model: a line for each kind.
void NoteDynamics(const Mechanism& mechanism,
                  std::vector<std::string>* notices) {
  const auto note = [&](const char* what, double Joint::*value,
                        const char* effect) {
    std::vector<std::string> names, values;
    for (const Joint& joint : mechanism.joints) {
      if (joint.held || !(joint.*value > 0.0)) continue;
      names.push_back(joint.name);
      values.push_back(ShortestText(joint.*value));
    }
    if (names.empty()) return;
    const bool one = names.size() == 1;
    notices->push_back(
        (one ? "joint '" + names[0] + "'" : "joints " + JoinSome(names)) +
        ": <dynamics> " + what + " " + JoinSome(values) +
        " is in the model as " + effect);
  };
  note("damping", &Joint::damping, "viscous_damping");
  note("friction", &Joint::friction, "coulomb_friction");
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
  NoteDynamics(mechanism, notices);
  return model;
}

Model AdaptModel(const Model& given, const Catalogue& catalogue,
                 std::vector<NamedValue>* locks,
                 std::vector<std::string>* notices, const ColumnMap& columns) {
  Mechanism mechanism = given.mechanism();
  for (const std::string& input : OwnInputs(columns, mechanism)) {
    if (!Contains(mechanism.inputs, input)) mechanism.inputs.push_back(input);
  }
  *locks = ResolveLocks(mechanism, *locks);
  if (locks->empty() &&
      mechanism.inputs.size() == given.mechanism().inputs.size()) {
    return given;
  }
  mechanism = LockJoints(mechanism, *locks, notices);
  std::vector<Located<std::string>> effects;
  for (const std::string& name : given.effects().names()) {
    effects.push_back({name, "the model's effects"});
  }
  DropHeldEffects(mechanism, &effects, notices);
  Model model(mechanism);
  for (const Located<std::string>& effect : effects) {
    model.AddEffect(catalogue.Make(effect.value, mechanism, effect.place));
  }
  MechanismParameters<double> nominal = given.nominal();
  nominal.effects = model.nominal().effects;
  model.SetNominal(nominal);
  const auto& of_given = given.effects().parameters();
  for (const EffectParameter& parameter : model.effects().parameters()) {
    for (size_t i = 0; i < of_given.size(); ++i) {
      if (of_given[i].name != parameter.name) continue;
      model.SetEffectParameter(parameter.name, given.nominal().effects[i]);
    }
  }
  return model;
}

Run ReadSessionRun(const Session& session, const std::string& file,
                   std::vector<std::string>* notices) {
  Run run = ReadRun(file, session.columns, session.model.mechanism(), notices);
  EditRun(session, &run, notices);
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
  if (!request.model.empty() || request.model_in_memory) return request.model;
  if (!spec.model) {
    throw InputError(
        "--model", "is missing",
        "give a URDF file or a shipped model: " + Join(ShippedModels()));
  }
  return spec.model->value;
}

void CheckFiles(const FitRequest& request) {
  if (request.traj.empty() && request.runs.empty()) {
    throw InputError("--traj", "is missing",
                     "give the recordings to fit: --traj run1.csv,run2.csv");
  }
  CheckDistinct(request.traj, request.holdout);
}

// What the request says of the recordings, with places for errors.
ColumnMap PlacedColumns(const FitRequest& request) {
  ColumnMap columns = request.columns;
  for (ColumnMapping& column : columns) column.place = "--columns";
  return columns;
}
ChannelEdits PlacedEdits(const FitRequest& request) {
  ChannelEdits edits{request.shift, request.ignore};
  for (ChannelShift& shift : edits.shifts) shift.place = "--shift";
  for (IgnoredSpan& span : edits.ignored) span.place = "--ignore";
  return edits;
}

// How the runs are to be read.
void FillReading(const FitRequest& request, const FitSpecification& spec,
                 Session* session) {
  const Mechanism& mechanism = session->model.mechanism();
  session->flag_columns = PlacedColumns(request);
  session->columns = MergeByName(spec.columns, session->flag_columns);
  session->flag_edits = PlacedEdits(request);
  session->edits = MergeEdits(spec.edits, session->flag_edits, mechanism);
  CheckEdits(session->edits, mechanism);
  std::vector<std::string> files = request.traj;
  files.insert(files.end(), request.holdout.begin(), request.holdout.end());
  for (const Run& run : request.runs) files.push_back(run.name);
  for (const Run& run : request.holdout_runs) files.push_back(run.name);
  CheckRunNames(session->flag_columns, session->flag_edits, mechanism, files);
}

// What the laws read that request and specification type: of files by the
// words of the laws, of runs in memory all that effects may read.
ColumnMap LawInputs(const FitRequest& request, const FitSpecification& spec,
                    const std::function<Mechanism()>& mechanism) {
  ColumnMap inputs;
  for (const auto* runs : {&request.runs, &request.holdout_runs}) {
    for (const Run& run : *runs) {
      for (const Input& input : run.inputs) {
        inputs.push_back({input.name, input.name, run.name});
      }
    }
  }
  std::vector<std::string> laws = request.add;
  laws.insert(laws.end(), request.candidates.begin(), request.candidates.end());
  for (const auto& effect : spec.effects) laws.push_back(effect.value);
  std::erase_if(laws, [](const std::string& effect) {
    return effect.find(':') == std::string::npos;
  });
  if (laws.empty()) return inputs;
  std::vector<std::string> files = request.traj;
  files.insert(files.end(), request.holdout.begin(), request.holdout.end());
  for (ColumnMapping& input : InputsOfLaws(laws, files, mechanism())) {
    inputs.push_back(std::move(input));
  }
  return inputs;
}

// The columns that the recordings have, files or in memory.
std::set<std::string> NamesShown(const FitRequest& request,
                                 const ColumnMap& columns,
                                 const Mechanism& mechanism) {
  std::set<std::string> names = NamesInRuns(mechanism, request.runs);
  names.merge(NamesInRuns(mechanism, request.holdout_runs));
  std::vector<std::string> files = request.traj;
  files.insert(files.end(), request.holdout.begin(), request.holdout.end());
  if (files.empty()) return names;
  std::set<std::string> of_files = NamesInFiles(mechanism, files, columns);
  if (of_files.empty()) return {};  // One cannot be read.
  names.merge(of_files);
  return names;
}

// All but the runs and what depends on them.
Session OpenWithoutRuns(const FitRequest& request, const FitSpecification& spec,
                        const Catalogue& catalogue) {
  const std::string wanted = WantedModel(request, spec);
  CheckFiles(request);
  const std::shared_ptr<const Model>& given = request.model_in_memory;
  if (given == nullptr && request.model.empty()) CheckShipped(*spec.model);
  std::string file;
  std::vector<std::string> notices;
  const std::vector<NamedValue> flag_locks = EachOnce(request.lock, "--lock");
  std::vector<NamedValue> locks = spec.lock;
  locks.insert(locks.end(), flag_locks.begin(), flag_locks.end());
  ColumnMap columns = MergeByName(spec.columns, PlacedColumns(request));
  const auto mechanism = [&] {
    return given ? given->mechanism() : LoadUrdf(FindModel(wanted));
  };
  for (ColumnMapping& input : LawInputs(request, spec, mechanism)) {
    columns.push_back(std::move(input));
  }
  if (given == nullptr) {
    for (NamedValue& lock :
         LocksOfUnshown(mechanism(), NamesShown(request, columns, mechanism()),
                        locks, &notices)) {
      locks.push_back(std::move(lock));
    }
  }
  Session session(
      given ? AdaptModel(*given, catalogue, &locks, &notices, columns)
            : OpenModel(wanted, catalogue, &locks, &file, &notices, columns));
  session.locked = locks;
  session.flag_locks = flag_locks;
  session.spec_file = spec.path;
  session.model_file = file;
  session.given = given;
  session.model_name = given == nullptr
                           ? std::filesystem::path(file).stem().string()
                       : wanted.empty() ? given->mechanism().name
                                        : wanted;
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

Session OpenSession(FitRequest request, const Catalogue& catalogue) {
  NameRuns(&request);
  const FitSpecification spec = ReadSpecification(request);
  Session session = OpenWithoutRuns(request, spec, catalogue);
  std::vector<std::string> read;
  const bool skip = request.skip_bad_runs;
  session.runs = ReadRuns(request.traj, "--traj", skip, &session, &read);
  session.holdout =
      ReadRuns(request.holdout, "--holdout", skip, &session, &read);
  const Processes& processes = ProcessesOf(session.options);
  if (!request.runs.empty() || !request.holdout_runs.empty()) {
    const Mechanism given = session.locked.empty() ? session.model.mechanism()
                            : session.given        ? session.given->mechanism()
                                            : LoadUrdf(session.model_file);
    DoAlike(processes, [&] {
      TakeRuns(std::move(request.runs), given, session, &session.runs, &read);
      TakeRuns(std::move(request.holdout_runs), given, session,
               &session.holdout, &read);
    });
  }
  const Mechanism& mechanism = session.model.mechanism();
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
  FillStart(request, spec, &session);
  CoverTables(&session);
  return session;
}

}  // namespace sysid
