#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sysid/api/diagnose.h"
#include "sysid/api/identify.h"
#include "sysid/diagnosis/diagnose.h"
#include "sysid/report/json.h"
#include "sysid/session/added_effects.h"
#include "sysid/session/diagnosis_session.h"
#include "sysid/session/session.h"
#include "sysid/stochastic/stochastic_fit.h"

namespace sysid {

// The document that the page shows: PageData of web/src/page_data.ts, which
// says units and shapes. Everything here turns numbers into text; nothing is
// fitted. Series are little-endian float32 in base64, missing numbers NaN in
// them and null elsewhere.

// What the models of a page share. Points at what must outlive it.
struct PageSource {
  std::string program;               // "sysid_fit"
  bool live = false;                 // whether there is a server to ask
  std::string command;               // that made the page, for a shell
  const Session* session = nullptr;  // as opened: the model as given
  // The runs that are shown, whatever a model was fitted to: for a fit those
  // of its problem, for a diagnosis those that it searches; null: none.
  const DataSet* train = nullptr;
  const DataSet* holdout = nullptr;
  // The command that fits with effects added and parameters held, both comma
  // separated; see CommandFromFlags.
  std::function<std::string(const std::string& add, const std::string& fix)>
      fit_command;
  // The command that simulates a motion that would decide between the rivals of
  // a diagnosis; empty where there is none. And what it would show, or why
  // there is none.
  std::string experiment, experiment_words;
};

// A fitted model as the page shows it.
struct PageFit {
  int id = 0;  // place in PageData.models
  std::string title;
  const Session* session = nullptr;  // with its model, effects, what is free
  const ShootingProblem* problem = nullptr;
  const Fit* fit = nullptr;
  const Holdout* holdout = nullptr;     // null: no held-out runs
  const CrossValidation* cv = nullptr;  // null: it was not cross-validated
  const AddedEffects* added = nullptr;  // by --add; null: none were
  const MixtureFit* mixture = nullptr;
  // Whether the text of prediction.csv goes in, where it is no larger than all
  // else; a server has it by its own address.
  bool with_prediction_csv = false;
  std::string next_command;
};

// A evaluated with what it does not keep itself: as PageFit wants it. Points at
// the evaluated.
struct ShownModel {
  Session session;
  std::optional<Holdout> holdout;
  const EvaluatedModel* evaluated = nullptr;
  PageFit Show(int id, const std::string& title) const;
};
ShownModel OpenEvaluatedModel(const Session& session,
                              const DiagnosisProblem& problem,
                              const EvaluatedModel& evaluated);

// What was identified; points at the result. Its next command is yet to be set.
PageFit ShowIdentified(const IdentifyResult& result);

PageFit ShowFinal(const FinalFit& final, int id);

// PageData with no models and no steps yet.
Json PageHeader(const PageSource& source);

// A ModelData. `diagnosis`: one of which this model is the base; null: it was
// not asked what is missing.
Json PageModel(const PageSource& source, const PageFit& fit,
               const Diagnosis* diagnosis);

// The files of a model that can be taken away: fit.json, prediction.csv,
// identified.urdf, identified.sysid.yaml.
struct ModelFile {
  std::string name, type;  // "fit.json", "application/json"
};
std::vector<ModelFile> ModelFiles();
// The text of one of them; empty for another name.
std::string ModelFileText(const PageFit& fit, const std::string& name);

// ModelData.wholeRuns: what became of a model of segments that was fitted once
// more, to whole runs.
Json PageWholeRuns(const FinalFit& final);

// A StepData: a change that led from a model to another; `from` -1: from one
// that is not shown.
Json PageStep(const DiagnosisStep& step, int model, int from);

// Whole documents.
Json FitPage(const PageSource& source, const PageFit& fit);
// `final`: null where the diagnosis was not fitted once more.
Json DiagnosisPage(const PageSource& source, const DiagnosisProblem& problem,
                   const Diagnosis& diagnosis, const FinalFit* final);
Json DiagnosisPage(const PageSource& source, const DiagnoseResult& result);

// The page with the document in it, one file that asks for nothing else; and
// the page that asks its server. Empty where the build has no page: then
// WhyNoPage() says why, in a sentence.
std::string ReportHtml(const Json& page);
std::string LivePage();
std::string WhyNoPage();

}  // namespace sysid
