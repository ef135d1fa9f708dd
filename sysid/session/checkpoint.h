#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "sysid/estimation/stage_log.h"

namespace sysid {

// The stages of a fit in a file, which is written anew after each of them,
// whole or not at all (write_file.h): CBOR (RFC 8949) of
//
//   {"sysid": version, "problem": ProblemChecksum, "stages": [...]}
//
// with all numbers to their last bit. Of several processes the first one reads
// and writes, the states of the runs of all: another number of them can go on.
class Checkpoint : public StageLog {
 public:
  // Begins with the stages of the file where `resume` asks for it and there is
  // one. The problem's processes must outlive this. Throws InputError where
  // that is not whole, or of another problem.
  Checkpoint(std::string file, const ShootingProblem& problem, bool resume);

  std::optional<StageOutcome> Next(const std::string& doing) override;
  void Keep(const StageOutcome& outcome) override;

  const std::string& file() const { return file_; }
  // Those of the file that the fit began with.
  size_t resumed() const { return resumed_; }
  // Why the last stages are not in the file; empty where they are.
  const std::string& trouble() const { return trouble_; }
  // Of a fit whose result is written.
  void Remove() const;

 private:
  void Take(const std::string& bytes);

  const std::string file_;
  const Processes& all_;
  const RolloutOptions rollout_;
  const int all_runs_, first_run_, own_runs_;  // of this process from the first
  nlohmann::json content_;
  size_t resumed_ = 0, next_ = 0;
  std::string trouble_;
};

// Of all that decides what a fit comes to: data with their noise, model, free
// parameters, options; not the number of threads or of processes.
std::uint64_t ProblemChecksum(const ShootingProblem& problem);

}  // namespace sysid
