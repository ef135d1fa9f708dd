// Says what is wrong with recordings and model before anything is fitted
// (docs/checks.md).

#include <filesystem>

#include "gflags/gflags.h"
#include "models/error.h"
#include "models/printable.h"
#include "sysid/checks/check.h"
#include "sysid/checks/remedy.h"
#include "sysid/estimation/time_limit.h"
#include "sysid/io/unreadable_run.h"
#include "sysid/io/write_file.h"
#include "sysid/report/findings.h"
#include "sysid/session/check_runs.h"
#include "sysid/session/check_session.h"
#include "sysid/session/effect_inputs.h"
#include "sysid/session/law_values.h"
#include "sysid/session/session_options.h"
#include "tools/fit_flags.h"
#include "tools/program.h"

namespace sysid {
namespace {

constexpr int kExitFindings = 1;

constexpr char kHelp[] =
    R"(sysid_check: what is wrong with recordings and model, before a fit

  sysid_check --model pendulum3 --traj data/runs/pendulum3.csv

  --model NAME|FILE.urdf     a shipped model (pendulum1..3, pendulum2_planar,
                             pendulum3_planar, cartpole, arm7) or a URDF
  --traj A.csv,B.csv         recordings; 'd/*.csv', @LISTFILE
  --holdout C.csv            more of them
  --spec FILE.yaml           what is to be fitted (default: MODEL.sysid.yaml
                             beside the URDF)
  --free a,b=0.5  --fix c=1  parameters to fit (from a start), to hold (at):
                             names, inertial (all of each link), 'link*.mass'
  --add effect@target,...    effects that are in the model
  --columns n=expr,...       foreign columns: t=time_ms*0.001,joint2.q=b-a
                             (of one run: b.csv/joint2.q=-b; below alike)
  --shift joint1.q=0.010     a column that was recorded late, by seconds
  --ignore joint1.q@12:14.5  measurements that are taken as missing
  --lock 'wheel_*,head=0.3'  joints held still
  --noise S                  of a measurement, rad or m (default: estimated)
  --residual heading|rotation
  --loss, --segment, --step, --integrator, --solver, --check: of sysid_fit, so
                             that its flags can be given as they are
  --threads N (default: all cores)    --skip_bad_runs
  --json FILE|-              machine-readable result
  --out DIR                  check.json
Each finding states its place, the evidence, the consequence for a fit and a
remedy, as a flag where possible; the worst is first (docs/checks.md). If the
recordings are correct and the model does not explain them, it says so.
Exit code: 0 nothing found, 1 findings, 2 bad input.
)";

// A run that the reader refuses, and what would read it right.
struct Refused {
  Finding finding;
  std::string file;
  NewColumns right;
};

// Reads what can be read.
void ReadAll(const std::vector<std::string>& files, bool skip, Session* session,
             std::vector<Run>* runs, std::vector<Refused>* refused) {
  for (const std::string& file : files) {
    if (!skip && !std::filesystem::exists(file)) {
      ReadSessionRun(*session, file, nullptr);  // says so
    }
    try {
      Run run = ReadGoodRun(*session, file, &session->notices);
      CheckMotion({run});
      runs->push_back(std::move(run));
    } catch (const MisreadColumn& error) {
      refused->push_back(
          {Unreadable(error), file, {{error.name(), error.expression()}}});
    } catch (const InputError& error) {
      // A flag that is wrong is no fault of the recording, unless it is to be
      // one of this recording alone.
      const bool of_flag = error.place().starts_with("--");
      if (of_flag && !skip) throw;
      refused->push_back({Unreadable(error), file, {}});
      if (of_flag) refused->back().finding.file = file;
    }
  }
}

// As findings. Where other runs can be read as they are, the remedy is for the
// refused one alone.
std::vector<Finding> FindingsOf(const std::vector<Refused>& refused,
                                const std::vector<std::string>& files,
                                const Session& session) {
  const bool others = session.runs.size() + session.holdout.size() > 0;
  std::vector<Finding> findings;
  for (const Refused& run : refused) {
    findings.push_back(run.finding);
    if (!others || run.right.empty()) continue;
    CheckInput input = InputOf(session);
    input.scope = RunScope(files, run.file);
    findings.back().remedies = {ColumnsFlag(input, run.right)};
  }
  return findings;
}

int Main() {
  const Catalogue catalogue;
  FitRequest request = RequestFromFlags();
  request.may_free_nothing = true;
  request.any_solver = true;  // its own fits are by lm
  Session session = OpenModelSession(request, catalogue);
  std::vector<Refused> refused;
  ReadAll(request.traj, request.skip_bad_runs, &session, &session.runs,
          &refused);
  ReadAll(request.holdout, request.skip_bad_runs, &session, &session.holdout,
          &refused);
  for (const Run* run : AllRunsOf(session)) {
    session.run_names.push_back(run->name);
  }
  for (int i = 0; i < session.model.effects().size(); ++i) {
    if (session.run_names.empty()) break;
    const Effect& effect = session.model.effects().effect(i);
    CheckCanRead(effect, AllRunsOf(session), "--add");
    CheckHasValues(effect, session.model.mechanism(), AllRunsOf(session),
                   "--add");
  }
  CheckOutputs(request, session);
  PrintNotices(session.notices, session.run_names);
  std::vector<std::string> runs = request.traj;
  runs.insert(runs.end(), request.holdout.begin(), request.holdout.end());
  const TimeLimit limit({}, DurationOf(request));
  session.options.stop = limit.stop();
  const size_t noticed = session.notices.size();
  CheckResult result = CheckSession(&session);
  result.findings = FindingsOf(refused, runs, session);
  result.findings.insert(result.findings.end(), session.findings.begin(),
                         session.findings.end());
  if (limit.stopped_by() == StoppedBy::kTime) {
    PrintNotices(session.notices, session.run_names, noticed);
  }
  const std::string json =
      CheckJson(session.model_name, runs, result, session.notices);
  GiveResult(
      [&] {
        if (!FLAGS_out.empty()) WriteIntoFolder("check.json", json);
      },
      json,
      [&] {
        return Printable(CheckText(session.model_name, runs.size(), result));
      });
  return result.findings.empty() ? kExitDone : kExitFindings;
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  return sysid::RunProgram(argc, argv, sysid::kHelp, sysid::Main);
}
