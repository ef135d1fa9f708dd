#pragma once

#include <string>
#include <vector>

#include "tests/acceptance/hidden/hidden_case.h"
#include "tests/acceptance/hidden/way.h"

namespace sysid {

// What a diagnosis said of a case, as the suite judges it. Errors are in units
// of the noise that was planted.
struct Outcome {
  struct Candidate {
    std::string name;
    std::vector<std::string> indistinguishable_from;
  };
  struct Step {
    Candidate added;
    double train_before = 0.0, train_after = 0.0;
    double holdout_before = 0.0, holdout_after = 0.0;
    double predicted_after = 0.0;  // of train
  };
  std::string verdict;            // "adequate", "missing_effect", "unexplained"
  std::vector<Candidate> ranked;  // by the first screen, best first
  std::vector<Step> added;
  std::vector<std::string> stand_ins;
  double train_before = 0.0, holdout_before = 0.0;
  double train_after = 0.0, holdout_after = 0.0;
  double seconds = 0.0;
  std::string fault;  // why there is no verdict; "" if there is one
};

// Fits the plain model, says what is missing, adds it, until nothing is; with
// all laws of the catalogue as candidates, or `withheld`, but for those that
// were planted, on any target. Of other ways than kGiven `added` has names and
// no errors.
Outcome DiagnoseCase(const HiddenData& data, bool withheld = false,
                     Way way = Way::kGiven);

// The error of the training runs, over the planted noise, of the plain model
// with only these of the planted effects, fitted from the truth.
double ErrorWith(const HiddenData& data,
                 const std::vector<PlantedEffect>& effects);

// The best that can be had: the plain model with what was planted, fitted from
// the truth. Its `ranked` and `added` are the truth.
Outcome AskOracle(const HiddenData& data);

}  // namespace sysid
