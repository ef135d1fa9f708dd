#include "sysid/parameters/fit_specification.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/support/error_text.h"

namespace sysid {
namespace {

using ::testing::StartsWith;

FitSpecification Parse(const std::string& text) {
  return ParseFitSpecification("dir/fit.yaml", text);
}

std::string ParseError(const std::string& text) {
  return ErrorText([&] { Parse(text); });
}

TEST(FitSpecificationTest, ReadsTheContractsExample) {
  const FitSpecification spec = Parse(R"(model: pendulum3.urdf
free:
  link1.length: {initial: 0.5, lower: 0.05, upper: 2.0}
  link2.length: {initial: 0.5, lower: 0.05, upper: 2.0, prior: {mean: 0.4, std: 0.1}}
fix:
  link1.mass: 1.0
effects:
  - coulomb_friction@joint1
columns: {t: "time", joint1.q: "pos1 * 0.0174532925"}
noise: 0.001
integrator: rk4
)");
  EXPECT_EQ(spec.path, "dir/fit.yaml");
  EXPECT_EQ(spec.model->value, "dir/pendulum3.urdf");
  EXPECT_EQ(spec.model->place, "dir/fit.yaml:1:8");
  ASSERT_EQ(spec.free.size(), 2u);
  EXPECT_EQ(spec.free[0].name, "link1.length");
  EXPECT_EQ(spec.free[0].initial, 0.5);
  EXPECT_EQ(spec.free[0].lower, 0.05);
  EXPECT_EQ(spec.free[0].upper, 2.0);
  EXPECT_FALSE(spec.free[0].prior);
  EXPECT_EQ(spec.free[0].place, "dir/fit.yaml:3:3");
  EXPECT_EQ(spec.free[1].prior->mean, 0.4);
  EXPECT_EQ(spec.free[1].prior->std, 0.1);
  ASSERT_EQ(spec.fix.size(), 1u);
  EXPECT_EQ(spec.fix[0].name, "link1.mass");
  EXPECT_EQ(spec.fix[0].value, 1.0);
  EXPECT_EQ(spec.fix[0].place, "dir/fit.yaml:6:3");
  ASSERT_EQ(spec.effects.size(), 1u);
  EXPECT_EQ(spec.effects[0].value, "coulomb_friction@joint1");
  EXPECT_EQ(spec.effects[0].place, "dir/fit.yaml:8:5");
  ASSERT_EQ(spec.columns.size(), 2u);
  EXPECT_EQ(spec.columns[1].name, "joint1.q");
  EXPECT_EQ(spec.columns[1].expression, "pos1 * 0.0174532925");
  EXPECT_EQ(spec.columns[1].place, "dir/fit.yaml:9:22");
  EXPECT_EQ(spec.noise->value, 0.001);
  EXPECT_EQ(spec.integrator->value, "rk4");
}

TEST(FitSpecificationTest, ReadsTheOtherSettings) {
  const FitSpecification spec = Parse(
      "model: pendulum3\nfree: [gravity, link1.mass]\nfix: [link2.mass]\n"
      "step: 0.01\nsegment: 0.5\nresidual: rotation\nsolver: adam\n"
      "loss: {name: huber, scale: 1.5}\n");
  EXPECT_EQ(spec.model->value, "pendulum3");
  ASSERT_EQ(spec.free.size(), 2u);
  EXPECT_EQ(spec.free[1].name, "link1.mass");
  EXPECT_FALSE(spec.free[1].initial);
  EXPECT_FALSE(spec.fix.at(0).value);
  EXPECT_EQ(spec.step->value, 0.01);
  EXPECT_EQ(spec.segment->value, 0.5);
  EXPECT_EQ(spec.residual->value, "rotation");
  EXPECT_EQ(spec.solver->value, "adam");
  EXPECT_EQ(spec.loss->value, "huber");
  EXPECT_EQ(spec.loss_scale, 1.5);
  EXPECT_EQ(Parse("loss: cauchy").loss->value, "cauchy");
  EXPECT_EQ(Parse("model: /a/../b.urdf").model->value, "/b.urdf");
}

TEST(FitSpecificationTest, AnEmptyFileIsAnEmptySpecification) {
  for (const std::string text : {"", "# nothing\n", "---\n", "~\n"}) {
    const FitSpecification spec = Parse(text);
    EXPECT_TRUE(spec.free.empty());
    EXPECT_FALSE(spec.model);
  }
  const FitSpecification keys = Parse("free:\nfix:\neffects:\ncolumns:\n");
  EXPECT_TRUE(keys.free.empty());
  EXPECT_EQ(Parse("free:\n  gravity:\n").free.at(0).name, "gravity");
}

TEST(FitSpecificationTest, ReportsUnknownKeysAtEveryLevel) {
  EXPECT_EQ(ParseError("model: a\nfreee: {}\n"),
            "dir/fit.yaml:2:1: unknown key 'freee' in the specification\n"
            "  hint: did you mean 'free'?");
  EXPECT_EQ(ParseError("free:\n  a: {inital: 1}\n"),
            "dir/fit.yaml:2:7: unknown key 'inital' in a\n"
            "  hint: did you mean 'initial'?");
  EXPECT_EQ(ParseError("free: {a: {prior: {mean: 1, sdt: 2}}}\n"),
            "dir/fit.yaml:1:29: unknown key 'sdt' in the prior of a\n"
            "  hint: known: mean, std");
  EXPECT_EQ(ParseError("loss: {nam: huber}"),
            "dir/fit.yaml:1:8: unknown key 'nam' in loss\n"
            "  hint: did you mean 'name'?");
  // Draws derive from --seed alone.
  EXPECT_THAT(
      ParseError("seed: 7\n"),
      StartsWith("dir/fit.yaml:1:1: unknown key 'seed' in the specification\n"
                 "  hint: known: model, free, fix, "));
}

TEST(FitSpecificationTest, ReportsKeysThatAreEmpty) {
  const std::string text =
      "dir/fit.yaml:1:8: a key of free is empty\n  hint: write a name";
  EXPECT_EQ(ParseError("free: {\"\": {}}\n"), text);
  EXPECT_EQ(ParseError("free: {!bin}\n"), text);  // by fuzzing
}

TEST(FitSpecificationTest, ReportsKeysGivenTwice) {
  const std::string hint = "\n  hint: keep one of them";
  EXPECT_EQ(
      ParseError("noise: 1\nnoise: 2\n"),
      "dir/fit.yaml:2:1: 'noise' is given twice in the specification" + hint);
  EXPECT_EQ(ParseError("free:\n  a: {}\n  a: {}\n"),
            "dir/fit.yaml:3:3: 'a' is given twice in free" + hint);
  EXPECT_EQ(ParseError("free: [a, a]\n"),
            "dir/fit.yaml:1:11: 'a' is given twice in free" + hint);
  EXPECT_EQ(ParseError("effects: [b@a, b@a]\n"),
            "dir/fit.yaml:1:16: 'b@a' is given twice in effects" + hint);
  EXPECT_EQ(ParseError("fix:\n  a: 1\nfree:\n  a:\n"),
            "dir/fit.yaml:2:3: 'a' is both free and fixed" + hint);
}

TEST(FitSpecificationTest, ReportsWrongTypes) {
  EXPECT_THAT(ParseError("- a\n"),
              StartsWith("dir/fit.yaml:1:1: the specification must be a map, "
                         "not a list\n  hint: write key: value; known keys: "
                         "model, free, fix, "));
  EXPECT_THAT(ParseError("just text\n"),
              StartsWith("dir/fit.yaml:1:1: the specification must be a map, "
                         "not 'just text'"));
  EXPECT_EQ(ParseError("free: 3\n"),
            "dir/fit.yaml:1:7: free must be a map, not '3'\n"
            "  hint: write free: {link1.length: {initial: 0.5}}, or a list of "
            "names");
  EXPECT_EQ(ParseError("free: {a: 0.5}\n"),
            "dir/fit.yaml:1:11: a must be a map, not '0.5'\n"
            "  hint: write a: {initial: 0.5, lower: 0.05, upper: 2}");
  EXPECT_EQ(ParseError("free: {a: {initial: high}}\n"),
            "dir/fit.yaml:1:21: initial of a must be a number, not 'high'");
  EXPECT_EQ(ParseError("free: {a: {lower: [1]}}\n"),
            "dir/fit.yaml:1:19: lower of a must be a number, not a list");
  EXPECT_EQ(ParseError("free: {a: {upper: .inf}}\n"),
            "dir/fit.yaml:1:19: upper of a must be a number, not '.inf'");
  EXPECT_EQ(ParseError("free: {a: {upper: 1e999}}\n"),
            "dir/fit.yaml:1:19: upper of a must be finite, not '1e999'");
  EXPECT_EQ(ParseError("fix: {a: {b: 1}}\n"),
            "dir/fit.yaml:1:10: a must be a number, not a map");
  EXPECT_EQ(ParseError("fix: 1\n"),
            "dir/fit.yaml:1:6: fix must be a map, not '1'\n"
            "  hint: write fix: {link1.mass: 1.0}, or a list of names");
  EXPECT_EQ(ParseError("effects: a@b\n"),
            "dir/fit.yaml:1:10: effects must be a list, not 'a@b'\n"
            "  hint: write effects: [coulomb_friction@joint1]");
  EXPECT_EQ(ParseError("effects: [{a: b}]\n"),
            "dir/fit.yaml:1:11: an entry of effects must be text, not a map\n"
            "  hint: write effects: [coulomb_friction@joint1]");
  EXPECT_EQ(ParseError("columns: [t]\n"),
            "dir/fit.yaml:1:10: columns must be a map, not a list\n"
            "  hint: write columns: {t: time, joint1.q: pos1}");
  EXPECT_EQ(ParseError("columns: {t: [a]}\n"),
            "dir/fit.yaml:1:14: the column of t must be text, not a list\n"
            "  hint: write columns: {t: time, joint1.q: pos1}");
  EXPECT_EQ(ParseError("noise:\n"), "dir/fit.yaml:1:1: 'noise' has no value");
  EXPECT_EQ(ParseError("free: {a: {initial: }}\n"),
            "dir/fit.yaml:1:12: 'initial' has no value");
  EXPECT_EQ(ParseError("columns: {t: }\n"),
            "dir/fit.yaml:1:11: 't' has no value");
  EXPECT_EQ(ParseError("model: {a: b}\n"),
            "dir/fit.yaml:1:8: model must be text, not a map");
  EXPECT_EQ(ParseError("? [a]\n: b\n"),
            "dir/fit.yaml:1:3: a key of the specification must be a name, not "
            "a list");
}

TEST(FitSpecificationTest, ReportsBoundsThatExcludeTheStart) {
  EXPECT_EQ(ParseError("free: {a: {initial: 3, lower: 0, upper: 2}}\n"),
            "dir/fit.yaml:1:11: the bounds of a exclude its start: initial 3 "
            "is above upper 2\n"
            "  hint: widen the bounds, or start within them");
  EXPECT_EQ(ParseError("free: {a: {initial: -1, lower: 0}}\n"),
            "dir/fit.yaml:1:11: the bounds of a exclude its start: initial -1 "
            "is below lower 0\n"
            "  hint: widen the bounds, or start within them");
  EXPECT_EQ(Parse("free: {a: {initial: 2, upper: 2}}").free.size(), 1u);
}

TEST(FitSpecificationTest, ReportsBoundsThatAreEmpty) {
  EXPECT_EQ(ParseError("free: {a: {lower: 2, upper: 2}}\n"),
            "dir/fit.yaml:1:11: the bounds of a are empty: lower 2 is not "
            "below upper 2\n"
            "  hint: to hold a parameter at a value, put it under fix");
}

TEST(FitSpecificationTest, ReportsImpossiblePriors) {
  EXPECT_EQ(ParseError("free: {a: {prior: {mean: 1, std: 0}}}\n"),
            "dir/fit.yaml:1:34: std of the prior of a must be positive, not "
            "'0'");
  EXPECT_EQ(ParseError("free: {a: {prior: {mean: 1}}}\n"),
            "dir/fit.yaml:1:19: the prior of a has no std\n"
            "  hint: write prior: {mean: 0.4, std: 0.1}");
  EXPECT_EQ(ParseError("free: {a: {prior: {std: 1}}}\n"),
            "dir/fit.yaml:1:19: the prior of a has no mean\n"
            "  hint: write prior: {mean: 0.4, std: 0.1}");
  EXPECT_EQ(ParseError("free: {a: {prior: 1}}\n"),
            "dir/fit.yaml:1:19: the prior of a must be a map, not '1'\n"
            "  hint: write prior: {mean: 0.4, std: 0.1}");
}

TEST(FitSpecificationTest, ReportsNumbersThatMustBePositive) {
  for (const std::string key : {"noise", "step", "segment"}) {
    const std::string column = std::to_string(key.size() + 3);
    EXPECT_EQ(ParseError(key + ": -1\n"), "dir/fit.yaml:1:" + column + ": " +
                                              key +
                                              " must be positive, not '-1'");
  }
  EXPECT_EQ(ParseError("loss: {name: huber, scale: 0}\n"),
            "dir/fit.yaml:1:28: scale of loss must be positive, not '0'");
}

TEST(FitSpecificationTest, ReportsUnknownWords) {
  EXPECT_EQ(ParseError("integrator: rk5\n"),
            "dir/fit.yaml:1:13: there is no integrator 'rk5'\n"
            "  hint: did you mean 'rk4'?");
  EXPECT_EQ(ParseError("residual: xyz\n"),
            "dir/fit.yaml:1:11: there is no residual 'xyz'\n"
            "  hint: known: heading, rotation");
  EXPECT_EQ(ParseError("solver: newton\n"),
            "dir/fit.yaml:1:9: there is no solver 'newton'\n"
            "  hint: known: lm, inverse_dynamics, adam, gmm");
  EXPECT_EQ(ParseError("loss: hubr\n"),
            "dir/fit.yaml:1:7: there is no loss 'hubr'\n"
            "  hint: did you mean 'huber'?");
  EXPECT_EQ(ParseError("loss: {scale: 1}\n"),
            "dir/fit.yaml:1:7: loss has no name\n"
            "  hint: write loss: {name: huber, scale: 1.5}");
}

TEST(FitSpecificationTest, TranslatesWhatIsNotYaml) {
  const std::string hint =
      "\n  hint: spaces, not tabs, make the indentation; brackets and quotes "
      "must be closed";
  EXPECT_EQ(ParseError("free: {a: 1\nnoise: 2\n"),
            "dir/fit.yaml:2:6: is not YAML: end of map flow not found" + hint);
  EXPECT_EQ(ParseError("free:\n\ta: 1\n"),
            "dir/fit.yaml:2:3: is not YAML: illegal map value" + hint);
  EXPECT_EQ(ParseError("noise: 1\nmodel: \"a\n"),
            "dir/fit.yaml:2:10: is not YAML: illegal EOF in scalar" + hint);
  EXPECT_THAT(ParseError("free: *nobody\n"), StartsWith("dir/fit.yaml:1:7: "));
  EXPECT_THAT(ParseError(std::string(100000, '[')), StartsWith("dir/fit.yaml"));
  EXPECT_EQ(
      ParseError(",noise: 1\n"),
      "dir/fit.yaml:1:1: is not YAML: ',noise: 1' cannot stand here" + hint);
  EXPECT_EQ(ParseError("{noise: 1} more\n"),
            "dir/fit.yaml:1:12: is not YAML: 'more' cannot stand here" + hint);
  EXPECT_EQ(ParseError("noise: 1\n---\nnoise: 2\n"),
            "dir/fit.yaml:2:1: a second document begins here\n"
            "  hint: a specification is one document: remove the '---'");
}

TEST(FitSpecificationTest, ReportsFilesThatCannotBeRead) {
  EXPECT_EQ(ErrorText([] { ReadFitSpecification("/nowhere/fit.yaml"); }),
            "/nowhere/fit.yaml: there is no such file\n"
            "  hint: check the name and the folder that you are in");
  EXPECT_EQ(ErrorText([] { ReadFitSpecification("/tmp"); }),
            "/tmp: is a folder, not a file\n  hint: name a file in it");
  EXPECT_EQ(ReadFitSpecification("/dev/null").free.size(), 0u);
}

TEST(FitSpecificationTest, ReadsLocks) {
  const FitSpecification spec =
      Parse("lock: {head_1: 0.3, 'wheel_*': 0, lift: }\n");
  ASSERT_EQ(spec.lock.size(), 3u);
  EXPECT_EQ(spec.lock[0].name, "head_1");
  EXPECT_EQ(spec.lock[0].value, 0.3);
  EXPECT_EQ(spec.lock[0].place, "dir/fit.yaml:1:8");
  EXPECT_EQ(spec.lock[1].name, "wheel_*");
  EXPECT_FALSE(spec.lock[2].value);
  EXPECT_EQ(Parse("lock: [head_1, 'wheel_*']\n").lock.size(), 2u);
  EXPECT_THAT(ParseError("lock: {head_1: up}\n"),
              StartsWith("dir/fit.yaml:1:16: head_1 must be a number"));
}

}  // namespace
}  // namespace sysid
