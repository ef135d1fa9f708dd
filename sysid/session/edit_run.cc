#include "sysid/session/edit_run.h"

#include "sysid/io/channel_edits.h"
#include "sysid/io/run_rows.h"

namespace sysid {

void EditRun(const Session& session, Run* run,
             std::vector<std::string>* notices) {
  CountTurns(session.model.mechanism(), run, notices);
  ApplyEdits(session.edits, session.model.mechanism(), run, notices);
  if (!session.edits.ignored.empty()) {
    DropUnmeasured(session.edits.ignored.front().place, run, notices);
    BeginMeasured(run, notices);
  }
}

}  // namespace sysid
