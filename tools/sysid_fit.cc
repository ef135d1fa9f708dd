// Fits the free parameters of a model to recordings
// (docs/interface.md section 1).

#include <unistd.h>

#include <cstdio>
#include <filesystem>

#include "gflags/gflags.h"
#include "models/error.h"
#include "sysid/api/identify.h"
#include "sysid/io/cell.h"
#include "sysid/report/fit_report.h"
#include "sysid/report/sampled_models.h"
#include "tools/fit_flags.h"
#include "tools/on_processes.h"
#include "tools/program.h"
#include "tools/stochastic_flags.h"

DECLARE_uint64(seed);
DEFINE_int32(sample, 0, "URDFs to draw from what was fitted, into --out");
DEFINE_bool(resume, false, "go on with the fit whose checkpoint is in --out");

namespace sysid {
namespace {

constexpr char kHelp[] =
    R"(sysid_fit: identify a mechanism's parameters from recordings

  sysid_fit --model pendulum3 --traj data/runs/pendulum3.csv --out result

  --model NAME|FILE.urdf     a shipped model (pendulum1..3, pendulum2_planar,
                             pendulum3_planar, cartpole, arm7) or a URDF
  --traj A.csv,B.csv         recordings, fitted together; 'd/*.csv', @LISTFILE
  --holdout C.csv            recordings that are only predicted
  --spec FILE.yaml           what to fit (default: MODEL.sysid.yaml beside it)
  --free a,b=0.5  --fix c=1  parameters to fit (from a start), to hold (at):
                             names, inertial (all of each link), 'link*.mass';
                             --free none compares the model as it stands
  --add effect@target,...    effects to add ('viscous_damping@*'): see
                             docs/effects.md, and sysid_diagnose
  --columns n=expr,...       foreign columns: t=time_ms*0.001,joint2.q=b-a
                             (of one run: b.csv/joint2.q=-b; below alike)
  --shift joint1.q=0.01      a column that was recorded late, by seconds
  --ignore joint1.q@12:14.5  measurements that are taken as missing
  --lock 'wheel_*,head=0.3'  joints held still
  --solver lm|inverse_dynamics|adam|gmm    Levenberg-Marquardt; least squares on
                             the efforts (docs/inverse_dynamics.md); Adam, and
                             on a mixture of Gaussians (docs/stochastic.md)
    --learning_rate 0.1  --schedule cosine|exponential|constant  --epochs 150
    --huber D (rad, m; default: none, 0.1)  --from_rest    of adam and gmm
    --kernels 3  --draws 16  --spread 0.3  --online    of gmm
  --integrator rk4|semi_implicit_euler|ros2  --step S (default: from the noise)
  --segment S  --noise S     length of a shooting segment (default: chosen); of
                             a measurement, rad or m (default: estimated)
  --residual heading|rotation    --loss none|huber|cauchy
  --start estimated|rest|known  at rest, or exactly as each first row says
  --check none|numbers|all   of the recordings (default: all)
  --threads N (all cores)  --time S (no limit)  --seed N  --skip_bad_runs
  --json FILE|-              machine-readable result
  --out DIR  --resume        report.html to look at, fit.json, prediction.csv,
                             identified.urdf; go on there with a killed fit
  --sample N                 also N URDFs and samples.csv there, drawn from the
                             estimate's normal distribution (gmm: its mixture)
Ctrl-C gives the best point so far, once more ends at once.
mpirun -n 8 sysid_fit ... (or srun) shares out the runs: docs/processes.md.
Exit code: 0 done, 1 no usable result, 2 bad input.
)";

// The names of what was written, in a line.
std::string WriteOutputs(const PageFit& fit) {
  if (fit.problem->processes().size() > 1) {
    std::vector<std::string> names;
    for (const ModelFile& file : ModelFiles()) {
      if (file.name == "prediction.csv") continue;
      WriteIntoFolder(file.name, ModelFileText(fit, file.name));
      names.push_back(file.name);
    }
    for (std::string& name : WriteFilesBeside(fit)) {
      names.push_back(std::move(name));
    }
    bool had = false;  // of an earlier fit, which they would be taken for
    for (const char* const name : {"/prediction.csv", "/report.html"}) {
      had = std::filesystem::remove(FLAGS_out + name) || had;
    }
    std::fprintf(stderr,
                 "note: no prediction.csv and no report.html%s: each process "
                 "knows the samples of its own runs alone\n",
                 had ? " (those of an earlier fit are removed)" : "");
    return Join(names);
  }
  std::vector<std::string> names = WriteModelFiles(fit);
  PageSource source = PageFromFlags("sysid_fit", *fit.session);
  source.train = &fit.problem->data();
  source.holdout =
      fit.holdout == nullptr ? nullptr : &fit.holdout->problem->data();
  if (WriteReport([&] { return FitPage(source, fit); })) {
    names.push_back("report.html");
  }
  return Join(names);
}

// A draw a file: sample_1.urdf, ..., and all in samples.csv.
void WriteSamples(const SampledModels& samples) {
  for (size_t i = 0; i < samples.urdfs.size(); ++i) {
    WriteIntoFolder("sample_" + std::to_string(i + 1) + ".urdf",
                    samples.urdfs[i]);
  }
  WriteIntoFolder("samples.csv", samples.csv);
}

std::string SampleFiles(const SampledModels& samples) {
  const size_t count = samples.urdfs.size();
  if (count == 0) return "";
  return ", samples.csv, sample_1.urdf" +
         (count > 1 ? " to sample_" + std::to_string(count) + ".urdf" : "");
}

std::string SampleText(const SampledModels& samples, const Fit& fit) {
  std::string text;
  for (const std::string& remark : samples.remarks) {
    text += "  " + remark + "\n";
  }
  if (!samples.urdfs.empty() && !fit.converged) {
    text += "  the samples are drawn from a fit that has not converged\n";
  }
  return text;
}

// What the session makes of flags that Identify does not know.
void CheckFlags(const Session& session) {
  CheckSolverFlags(session.solver);
  if (!FlagGiven("sample")) return;
  CheckCount("sample", FLAGS_sample, 100000);
  CheckSampling(session, FLAGS_sample);
  if (!FLAGS_out.empty()) return;
  throw InputError("--sample", "has nowhere to write to",
                   "name a folder: --out DIR");
}

IdentifyRequest IdentifyRequestFromFlags(ProcessGroup* group, Watch* watch) {
  IdentifyRequest request;
  static_cast<FitRequest&>(request) = RequestFromFlags();
  if (group != nullptr) {
    request.processes = group->shared_from_this();
    if (request.threads == 0) request.threads = group->CoresEach();
  }
  request.adam = AdamOptionsFromFlags();
  request.mixture = MixtureOptionsFromFlags();
  if (!FLAGS_out.empty()) request.checkpoint = FLAGS_out + "/checkpoint.cbor";
  request.resume = FLAGS_resume;
  request.callbacks = CallbacksFromFlags(request, group, watch, CheckFlags);
  return request;
}

// Everything that is to be written, and the text or JSON on standard output.
void Give(const IdentifyResult& result, const SampledModels& samples,
          bool colour) {
  PageFit shown = ShowIdentified(result);
  shown.next_command = CommandFromFlags("sysid_diagnose") +
                       FlagWith("add", "") + FlagWith("fix", "");
  std::string written;  // once all of it is
  GiveResult(
      [&] {
        if (FLAGS_out.empty()) return;
        const std::string names = WriteOutputs(shown);
        if (!samples.urdfs.empty()) WriteSamples(samples);
        written = "  written to " + FLAGS_out + ": " + names +
                  SampleFiles(samples) + "\n";
      },
      FitJson(result),
      [&] {
        return FitText(result, colour) + written +
               SampleText(samples, result.fit());
      });
}

int Main(ProcessGroup* group) {
  Watch watch;
  const IdentifyResult result =
      Identify(IdentifyRequestFromFlags(group, &watch));
  watch.ClearLine();
  PrintNotices(result.session.notices, result.session.run_names,
               result.notices_when_ready);
  if (group != nullptr) group->Finish();
  SampledModels samples;
  if (FLAGS_sample > 0) {
    samples = SampleModels(result.session, *result.problem, result.solved,
                           FLAGS_sample, FLAGS_seed);
  }
  if (group == nullptr || group->rank() == 0) {
    // The terminal of a process of mpirun is one, wherever mpirun's goes.
    Give(result, samples, group == nullptr && isatty(STDOUT_FILENO) == 1);
    // What was interrupted can go on.
    if (result.checkpoint != nullptr &&
        !result.session.options.stop.stop_requested()) {
      result.checkpoint->Remove();
    }
  }
  const Fit& fit = result.fit();
  if (!result.IsAnswer()) {
    watch.SayKept("the best point so far", WritesFiles());
    std::fprintf(stderr, "error: no usable result: %s\n",
                 fit.termination.c_str());
  }
  if (!samples.failure.empty()) {
    std::fprintf(stderr, "error: no samples: %s\n", samples.failure.c_str());
  }
  return result.IsAnswer() && samples.failure.empty() ? kExitDone
                                                      : kExitNoResult;
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  return sysid::RunOnProcesses(argc, argv, sysid::kHelp, sysid::Main);
}
