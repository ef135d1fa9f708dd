// Serves the interactive page of a model and its runs on loopback
// (docs/interface.md section 1).

#include <csignal>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "gflags/gflags.h"
#include "models/error.h"
#include "sysid/report/page_data.h"
#include "sysid/session/check_session.h"
#include "sysid/session/diagnosis_session.h"
#include "sysid/session/named_values.h"
#include "sysid/studio/server.h"
#include "sysid/studio/studio.h"
#include "tools/fit_flags.h"
#include "tools/program.h"

DEFINE_int32(port, 8080, "port on 127.0.0.1; 0: any free one");
DECLARE_uint64(seed);
DEFINE_string(candidates, "", "effects to consider; all where not given");

namespace sysid {
namespace {

constexpr char kHelp[] =
    R"(sysid_studio: the page on which a model is seen to fail, and is mended

  sysid_studio --model pendulum2_planar --traj a.csv,b.csv --holdout c.csv \
    --out session

Prints the address of the page, for a browser on this machine, once it is
served; Ctrl-C ends it.

  --model NAME|FILE.urdf     a shipped model (pendulum1..3, pendulum2_planar,
                             pendulum3_planar, cartpole, arm7) or a URDF
  --traj A.csv,B.csv         recordings, fitted together; 'd/*.csv', @LISTFILE
  --holdout C.csv            recordings not fitted, which decide between effects
                             (default: the last quarter of every run)
  --port N                   on 127.0.0.1 (default: 8080; 0: any free one)
  --out DIR                  saves every model as it is fitted; the same
                             command continues there
)";

constexpr char kHelpOnExit[] = "Exit code: 0 ended by Ctrl-C, 2 bad input.\n";

StudioSetup OpenSetup() {
  const Catalogue catalogue;
  FitRequest request = RequestFromFlags();
  request.candidates = SplitEffects(FLAGS_candidates, "--candidates");
  request.may_free_nothing = true;
  request.assumes_inertia = true;
  Session session = OpenSession(request, catalogue);
  const auto candidates =
      ChooseCandidates(catalogue, session, request.candidates, "--candidates");
  DiagnosisProblem problem = OpenDiagnosis(session, &session.notices);
  // Hypotheses about the data take a fit: sysid_check asks them.
  CheckSessionNumbers(&session);
  StudioSetup setup(session);
  setup.problem = problem;
  setup.candidates = candidates;
  setup.page = PageFromFlags("sysid_studio", session);
  setup.folder = FLAGS_out;
  setup.seed = FLAGS_seed;
  return setup;
}

// What GET / gives where the build has no page.
std::string PageOrWhyNot() {
  const std::string page = LivePage();
  if (!page.empty()) return page;
  std::fprintf(stderr, "note: no page: %s\n", WhyNoPage().c_str());
  return "<!DOCTYPE html><title>sysid_studio</title><p>This build has no page: "
         "it has only <a href=\"/api/page\">its data</a>.";
}

int Main() {
  if (!FLAGS_json.empty()) {
    throw InputError("--json", "is nothing that sysid_studio writes",
                     "--out saves the session");
  }
  if (FlagGiven("time")) {
    throw InputError("--time", "has no meaning here",
                     "a fit of the page ends by its button");
  }
  StudioSetup setup = OpenSetup();
  const std::vector<std::string> notices = setup.session.notices;
  const sigset_t interrupts = BlockInterrupts();
  // Before anything is written.
  StudioServer server(PageOrWhyNot());
  const int port = server.Listen(FLAGS_port, "--port");
  Studio studio(std::move(setup));
  PrintNotices(notices);
  if (studio.models() == 0) studio.Start();
  WriteStdout("http://127.0.0.1:" + std::to_string(port) + "/\n");
  std::thread serving([&] { server.Serve(&studio); });
  int signal = 0;
  sigwait(&interrupts, &signal);
  studio.Close();
  server.Stop();
  serving.join();
  return kExitDone;
}

}  // namespace
}  // namespace sysid

int main(int argc, char** argv) {
  return sysid::RunProgram(argc, argv,
                           std::string(sysid::kHelp) +
                               sysid::kDiagnosisFlagsHelp + sysid::kHelpOnExit,
                           sysid::Main, {"json", "solver", "time"});
}
