#include "tools/fit_flags.h"

#include <cctype>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <utility>

#include "gflags/gflags.h"
#include "models/error.h"
#include "sysid/io/cell.h"
#include "sysid/io/write_file.h"
#include "sysid/report/export_files.h"
#include "sysid/report/fit_report.h"
#include "sysid/session/named_values.h"
#include "sysid/session/run_list.h"
#include "sysid/session/session_options.h"
#include "tools/program.h"

DEFINE_string(model, "", "shipped model's name, or a URDF file");
DEFINE_string(traj, "", "runs to fit: files, patterns, @LIST");
DEFINE_string(holdout, "", "runs to predict only, as --traj");
DEFINE_bool(skip_bad_runs, false, "set runs aside that cannot be read");
DEFINE_string(spec, "", "fit specification, YAML");
DEFINE_string(free, "", "parameters to fit, name or name=start");
DEFINE_string(fix, "", "parameters to hold, name or name=value");
DEFINE_string(add, "", "effects to add, effect@target");
DEFINE_string(columns, "", "name=expression of the file's columns");
DEFINE_string(shift, "", "column=seconds that it was recorded late");
DEFINE_string(lock, "", "joints to hold still, name or name=position");
DEFINE_string(ignore, "", "column@from:to, taken as not measured");
DEFINE_string(solver, "", "lm, inverse_dynamics, adam or gmm");
DEFINE_string(integrator, "", "rk4, semi_implicit_euler or ros2");
DEFINE_double(step, 0, "integration step, s");
DEFINE_double(segment, 0, "length of a shooting segment, s");
DEFINE_double(noise, 0, "standard deviation of a measurement");
DEFINE_string(residual, "", "heading or rotation");
DEFINE_string(loss, "", "none, huber or cauchy");
DEFINE_string(check, "all", "none, numbers or all");
DEFINE_string(start, "", "estimated, rest or known");
DEFINE_double(time, 0, "longest duration, s; 0: as long as it takes");
DEFINE_int32(threads, 0, "worker threads; 0: all cores");
DEFINE_uint64(seed, 1, "every random draw derives from it");
DEFINE_string(json, "", "result as JSON; - is standard output");
DEFINE_string(out, "", "folder for every result");

namespace sysid {

const char kDiagnosisFlagsHelp[] =
    R"(  --candidates a,b@joint1    effects to consider: kind, name or pattern
                             (default: every effect on every joint and link)
  --spec FILE.yaml           what to fit (default: MODEL.sysid.yaml beside it)
  --free a,b=0.5  --fix c=1  parameters to fit (from a start), to hold (at);
                             parameters fixed by name are taken as exact
  --add effect@target,...    effects that are in the model already, as pattern
                             too ('viscous_damping@*'; --free 'link*.mass')
  --columns n=expr,...       foreign columns: t=time_ms*0.001,joint2.q=b-a
                             (of one run: b.csv/joint2.q=-b; below alike)
  --shift joint1.q=0.01      a column that was recorded late, by seconds
  --ignore joint1.q@12:14.5  measurements that are taken as missing
  --lock 'wheel_*,head=0.3'  joints held still
  --integrator rk4|semi_implicit_euler|ros2  --step S (default: from the noise)
  --segment S                length of a shooting segment (default: chosen)
  --noise S                  of a measurement, rad or m (default: estimated)
  --residual heading|rotation    --loss none|huber|cauchy
  --start estimated|rest|known   how runs begin
  --threads N (default: all cores)    --seed N    --skip_bad_runs
)";

namespace {

// How to fit, as far as words say it.
void ReadWords(FitRequest* request) {
  CheckWord("solver", FLAGS_solver);
  request->solver = FLAGS_solver;
  if (!FLAGS_integrator.empty()) {
    request->integrator = ParseIntegrator(FLAGS_integrator, "--integrator");
  }
  if (!FLAGS_residual.empty()) {
    request->residual = ParseOrientation(FLAGS_residual);
  }
  if (!FLAGS_loss.empty()) request->loss = ParseLoss(FLAGS_loss);
  if (!FLAGS_start.empty()) request->start = ParseStart(FLAGS_start);
  if (FlagGiven("check")) request->check = ParseCheckLevel(FLAGS_check);
}

}  // namespace

FitRequest RequestFromFlags() {
  FitRequest request;
  request.model = FLAGS_model;
  request.traj = ExpandRuns(SplitList(FLAGS_traj, "--traj"), "--traj");
  request.holdout =
      ExpandRuns(SplitList(FLAGS_holdout, "--holdout"), "--holdout");
  request.skip_bad_runs = FLAGS_skip_bad_runs;
  request.spec = FLAGS_spec;
  request.free_none = FLAGS_free == "none";
  if (!request.free_none) request.free = SplitAssignments(FLAGS_free, "--free");
  request.fix = SplitAssignments(FLAGS_fix, "--fix");
  request.add = SplitEffectNames(FLAGS_add, "--add");
  request.columns = ParseColumnMap(FLAGS_columns);
  request.shift = ParseShifts(FLAGS_shift, "--shift");
  request.ignore = ParseIgnored(FLAGS_ignore, "--ignore");
  request.lock = SplitAssignments(FLAGS_lock, "--lock");
  request.threads = FLAGS_threads;
  if (FlagGiven("step")) request.step = FLAGS_step;
  if (FlagGiven("segment")) request.segment = FLAGS_segment;
  if (FlagGiven("noise")) request.noise = FLAGS_noise;
  if (FlagGiven("time")) request.time = FLAGS_time;
  ReadWords(&request);
  return request;
}

std::string CommandFromFlags(const std::string& program) {
  std::string command = program;
  for (const char* name : {"model", "lock", "traj", "holdout", "spec", "free",
                           "columns", "shift", "ignore", "integrator", "step",
                           "segment", "noise", "residual", "loss", "start"}) {
    if (!FlagGiven(name)) continue;
    command += std::string(" --") + name + " " + ShellWord(FlagText(name));
  }
  if (FLAGS_skip_bad_runs) command += " --skip_bad_runs";
  return command;
}

std::string FlagWith(const std::string& flag, const std::string& more) {
  std::string value = FlagText(flag);
  if (!value.empty() && !more.empty()) value += ",";
  value += more;
  return value.empty() ? "" : " --" + flag + " " + ShellWord(value);
}

std::string SimulationFromFlags(const Session& session,
                                const NextExperiment& experiment) {
  // The specification may have the model.
  std::string model = FlagText("model");
  if (model.empty()) model = session.model_file;
  std::string command = "sysid_simulate --model " + ShellWord(model);
  for (const auto& [name, value] : experiment.flags) {
    command += " --" + name + " " + ShellWord(value);
  }
  return command;
}

PageSource PageFromFlags(const std::string& program, const Session& session) {
  const auto command = [](const std::string& name, const std::string& add,
                          const std::string& fix) {
    return CommandFromFlags(name) + FlagWith("add", add) + FlagWith("fix", fix);
  };
  PageSource source;
  source.program = program;
  source.command = program + ArgumentsText();
  source.session = &session;
  source.fit_command = [command](const std::string& add,
                                 const std::string& fix) {
    return command("sysid_fit", add, fix);
  };
  return source;
}

void WriteIntoFolder(const std::string& name, const std::string& text) {
  const std::filesystem::path out = FLAGS_out;
  WriteFileAtomically((out / name).string(), text);
}

std::vector<std::string> WriteFilesBeside(const PageFit& fit) {
  std::vector<std::string> names;
  for (const NamedText& file : FilesBeside(fit)) {
    WriteIntoFolder(file.name, file.text);
    names.push_back(file.name);
  }
  // One of an earlier fit would be taken for this one's.
  for (const char* const name : {"identified.xml", "identified.sdf"}) {
    if (Contains(names, name)) continue;
    std::filesystem::remove(std::filesystem::path(FLAGS_out) / name);
    std::fprintf(stderr, "note: no %s: export.json says why\n", name);
  }
  return names;
}

std::vector<std::string> WriteModelFiles(const PageFit& fit) {
  std::vector<std::string> names;
  for (const ModelFile& file : ModelFiles()) {
    WriteIntoFolder(file.name, ModelFileText(fit, file.name));
    names.push_back(file.name);
  }
  for (std::string& name : WriteFilesBeside(fit)) {
    names.push_back(std::move(name));
  }
  return names;
}

bool WriteReport(const std::function<Json()>& page) {
  const std::string missing = WhyNoPage();
  if (!missing.empty()) {
    std::fprintf(stderr, "note: no report.html: %s\n", missing.c_str());
    return false;
  }
  WriteIntoFolder("report.html", ReportHtml(page()));
  return true;
}

void CheckOutputs(const FitRequest& request, const Session& session) {
  if (!FLAGS_json.empty() && !IsStdout(FLAGS_json)) {
    std::vector<std::string> inputs = request.traj;
    inputs.insert(inputs.end(), request.holdout.begin(), request.holdout.end());
    inputs.push_back(session.model_file);
    inputs.push_back(session.spec_file);
    CheckIsNoInput("--json", FLAGS_json, inputs);
    CheckWritableFile(FLAGS_json);
  }
  if (!FLAGS_out.empty()) CheckWritableFolder(FLAGS_out, "--out");
}

Callbacks CallbacksFromFlags(const FitRequest& request,
                             const Processes* processes, Watch* watch,
                             std::function<void(const Session&)> check) {
  Callbacks callbacks;
  callbacks.stop = watch->stop();
  callbacks.progress = watch->progress();
  callbacks.remark = [](const std::string& remark) { PrintNotices({remark}); };
  const bool is_first = processes == nullptr || processes->rank() == 0;
  callbacks.ready = [=, check = std::move(check)](const Session& session) {
    if (check) check(session);
    if (is_first) CheckOutputs(request, session);
    watch->Begin();
    PrintNotices(session.notices, session.run_names);
  };
  return callbacks;
}

bool WritesFiles() {
  return !FLAGS_out.empty() || (!FLAGS_json.empty() && !IsStdout(FLAGS_json));
}

void GiveResult(const std::function<void()>& write_files,
                const std::string& json,
                const std::function<std::string()>& text) {
  const bool to_stdout = IsStdout(FLAGS_json);
  std::exception_ptr failed;
  try {
    write_files();
    if (!FLAGS_json.empty() && !to_stdout) {
      WriteFileAtomically(FLAGS_json, json);
    }
  } catch (const InputError&) {
    failed = std::current_exception();
  }
  WriteStdout(to_stdout ? json : text());
  if (failed) std::rethrow_exception(failed);
}

}  // namespace sysid
