#include "sysid/io/expression.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace sysid {
namespace {

using ::testing::ElementsAre;

const std::vector<std::string>& Header() {
  static const auto& header = *new std::vector<std::string>{
      "t",         "a",   "b",    "a-b",   "/js/pos[0]", "two words", "-c",
      "say \"x\"", "1e3", "rpm*", "(deg)", "",           "abs",       "exp(a)"};
  return header;
}

// Where the column with index i has i + 1.
double Value(const std::string& text) {
  Expression expression;
  ExpressionFault fault;
  if (!ParseExpression(text, Header(), &expression, &fault)) {
    ADD_FAILURE() << text << ": " << fault.what;
    return 0.0;
  }
  std::vector<double> cells;
  for (const int column : expression.columns()) cells.push_back(column + 1.0);
  return expression.Evaluate(cells);
}

TEST(ExpressionTest, ReadsArithmetic) {
  const struct {
    std::string text;
    double value;
    bool has_factor;
  } cases[] = {
      {"a", 2, false},
      {"a+b", 5, false},
      {"a - 0.5", 1.5, false},
      {"a\t-\t0.5", 1.5, false},
      {"+a", 2, false},
      {"a*1", 2, true},
      {"-a", -2, true},
      {"--a", 2, true},
      {"2*a+b", 7, true},
      {"a+b*2", 8, true},
      {"(a+b)*2", 10, true},
      {"a - b - t", -2, false},
      {"t/a/b", 1.0 / 2 / 3, true},
      {"-a*b", -6, true},
      {"a-pi", 2 - M_PI, false},
      {"a*pi/180", 2 * M_PI / 180, true},
      {"a*-2 - 1e-3", -4.001, true},
      {"-(a-3)*.5", 0.5, true},
      {"(a-90)*0.0174532925", -88 * 0.0174532925, true},
      {"a-0.002*t", 1.998, true},
      {"((a))", 2, false},
      {"2*(3+4)*a", 28, true},
      {"a+1-1", 2, false},
      {"a^2", 4, true},
      {"-a^2", -4, true},
      {"a ^ -1", 0.5, true},
      {"2^3^2*a", 1024, true},
      {"a^0.5+1", std::sqrt(2.0) + 1, true},
      {"a^b", 8, true},
      {"sqrt(a)", std::sqrt(2.0), true},
      {"sin(a*pi/180)", std::sin(2 * M_PI / 180), true},
      {"atan2(a, b)", std::atan2(2.0, 3.0), true},
      {"atan2(-a,/js/pos[0])", std::atan2(-2.0, 5.0), true},
      {"max (a,b)-min(a,(b))", 1, true},
  };
  for (const auto& c : cases) {
    EXPECT_DOUBLE_EQ(Value(c.text), c.value) << c.text;
    Expression expression;
    ExpressionFault fault;
    ASSERT_TRUE(ParseExpression(c.text, Header(), &expression, &fault));
    EXPECT_EQ(expression.has_factor(), c.has_factor) << c.text;
  }
}

TEST(ExpressionTest, TheLongestColumnThatIsThereWins) {
  const struct {
    std::string text;
    double value;
  } cases[] = {
      {"a-b", 4},
      {"a-b*2", 8},
      {"a - b", -1},
      {"a -b", -1},
      {"/js/pos[0]*2", 10},
      {"-/js/pos[0]/2", -2.5},
      {"two words", 6},
      {"two words*2", 12},
      {"-c", 7},
      {"-c*2", 14},
      {"2*-c", 14},
      {"say \"x\"*2", 16},
      {"rpm*", 10},
      {"(deg)*2", 22},
      {"((deg)+1)*2", 24},
      // A number is one, unless it is all there is.
      {"1e3", 9},
      {"1e3*a", 2000},
      {"'1e3'*a", 18},
      {"'a'-b", -1},
      {"\"a\" - 'b'", -1},
      {"abs", 13},
      {"abs*2", 26},
      {"abs(b)", 3},
      {"exp(a)*2", 28},
  };
  for (const auto& c : cases) EXPECT_EQ(Value(c.text), c.value) << c.text;
}

TEST(ExpressionTest, NamesEachColumnOnce) {
  Expression expression;
  ExpressionFault fault;
  ASSERT_TRUE(ParseExpression("b*a+b/t", Header(), &expression, &fault));
  EXPECT_THAT(expression.columns(), ElementsAre(2, 1, 0));
  EXPECT_FALSE(expression.is_column());
  ASSERT_TRUE(ParseExpression("(b)", Header(), &expression, &fault));
  EXPECT_TRUE(expression.is_column());
  EXPECT_THAT(Expression::OfColumn(3).columns(), ElementsAre(3));
  EXPECT_EQ(Expression::OfColumn(3).Evaluate(std::vector<double>{5.0}), 5.0);
}

TEST(ExpressionTest, AMissingCellMakesTheResultMissing) {
  const double missing = std::numeric_limits<double>::quiet_NaN();
  Expression expression;
  ExpressionFault fault;
  ASSERT_TRUE(ParseExpression("a/b", Header(), &expression, &fault));
  EXPECT_TRUE(std::isnan(expression.Evaluate(std::vector{missing, 1.0})));
  EXPECT_TRUE(std::isnan(expression.Evaluate(std::vector{1.0, missing})));
  EXPECT_TRUE(std::isinf(expression.Evaluate(std::vector{1.0, 0.0})));
}

TEST(ExpressionTest, SaysWhatIsWrongAndWhere) {
  const struct {
    std::string text;
    size_t at;
    std::string what;
  } cases[] = {
      {"a*", 2, "a column, a number or '(' is expected at its end"},
      {"", 0, "a column, a number or '(' is expected at its end"},
      {"a+*b", 2, "a column, a number or '(' is expected before '*'"},
      {"a*)", 2, "a column, a number or '(' is expected before ')'"},
      {"()", 1, "a column, a number or '(' is expected before ')'"},
      {"a b", 2, "an operator (+ - * / ^) is expected before 'b'"},
      {"a 2", 2, "an operator (+ - * / ^) is expected before '2'"},
      {"(a b)", 3, "an operator (+ - * / ^) or ')' is expected before 'b)'"},
      {"(a+b", 0, "a '(' that is not closed"},
      {"2*(a", 2, "a '(' that is not closed"},
      {"a)", 1, "a ')' that closes nothing"},
      {"2*3", 0, "there is no column in '2*3'"},
      {"a*0", 1, "a factor that is zero"},
      {"(1-1)*a", 5, "a factor that is zero"},
      {"a/(2-2)", 1, "a division by zero"},
      {"a*(1e300*1e300)", 8, "a number that is not finite"},
      {"2*'a", 2, "a quotation mark that is not closed"},
      {"2*zz", 2, "no column 'zz'"},
      {"a*phi", 2, "no column 'phi'"},
      {"a*inf", 2, "no column 'inf'"},
      {"a*0x10", 2, "no column '0x10'"},
      {"a*1.2.3", 2, "no column '1.2.3'"},
      {"b*'zz'", 2, "no column 'zz'"},
      {"ab", 0, "no column 'ab'"},
      {"a*^2", 2, "a column, a number or '(' is expected before '^'"},
      {"a^", 2, "a column, a number or '(' is expected at its end"},
      {"abs()", 4, "a column, a number or '(' is expected before ')'"},
      {"min(,a)", 4, "a column, a number or '(' is expected before ','"},
      {"2*abs(a,b)", 2, "abs takes one argument, and not 2"},
      {"atan2(a)", 0,
       "atan2 takes two arguments, such as atan2(a, b), and not 1"},
      {"2*sin(a", 5, "a '(' that is not closed"},
      {"min(a b)", 6,
       "an operator (+ - * / ^), ',' or ')' is expected before 'b)'"},
      {"a*sqrt(-1)", 2, "a number that is not finite"},
      {"a*sqr(a)", 2, "no column 'sqr(a'"},
      {"a*sin", 2, "no column 'sin'"},
      {"a,b", 0, "no column 'a,b'"},
      {"min(a,zz)", 6, "no column 'zz'"},
      {"min(zz,a)", 4, "no column 'zz'"},
      {std::string(51, '(') + "a", 50,
       "more than 50 signs and parentheses in each other"},
  };
  for (const auto& c : cases) {
    Expression expression;
    ExpressionFault fault;
    ASSERT_FALSE(ParseExpression(c.text, Header(), &expression, &fault))
        << c.text;
    EXPECT_EQ(fault.what, c.what) << c.text;
    EXPECT_EQ(fault.at, c.at) << c.text;
    EXPECT_NE(fault.hint, "") << c.text;
  }
  std::string power = "a";
  for (int i = 0; i < 51; ++i) power += "^a";
  std::string sum = "a";
  for (int i = 0; i < 1000; ++i) sum += "+a";
  Expression expression;
  ExpressionFault fault;
  ASSERT_FALSE(ParseExpression(sum, Header(), &expression, &fault));
  EXPECT_EQ(fault.what, "more than 1000 operations");
  ASSERT_FALSE(ParseExpression(power, Header(), &expression, &fault));
  EXPECT_EQ(fault.what,
            "more than 50 powers, signs and parentheses in each other");
  EXPECT_EQ(fault.at, 101u);
}

// A random expression as text, with its value by the same operations in the
// same order.
class RandomExpression {
 public:
  explicit RandomExpression(unsigned seed) : random_(seed) {}

  // `precedence`: 0 a sum, 1 a product, 2 a factor may stand here unbracketed.
  double Write(int depth, int precedence, std::string* text) {
    const int kind = depth == 0 ? Draw(2) : Draw(7);
    if (Draw(3) == 0) *text += " ";
    switch (kind) {
      case 0: {
        const int column = Draw(3);
        *text += Header()[column];
        *text += Draw(2) ? " " : "";
        return column + 1.0;
      }
      case 1: {
        const double number = (1 + Draw(9)) * 0.25;
        *text += std::to_string(number);
        return number;
      }
      case 2: {
        *text += "- ";  // "-c" is a column
        return -Write(depth - 1, 2, text);
      }
      default: {
        const bool sum = kind < 5;
        const bool brackets = precedence > (sum ? 0 : 1);
        if (brackets) *text += "(";
        const double left = Write(depth - 1, sum ? 0 : 1, text);
        const char op = sum ? (kind == 3 ? '+' : '-') : kind == 5 ? '*' : '/';
        // "a-b" is a column.
        *text += std::string(" ") + op + " ";
        const double right = Write(depth - 1, sum ? 1 : 2, text);
        if (brackets) *text += ")";
        return op == '+'   ? left + right
               : op == '-' ? left - right
               : op == '*' ? left * right
                           : left / right;
      }
    }
  }

 private:
  int Draw(int n) { return static_cast<int>(random_() % n); }
  std::mt19937 random_;
};

TEST(ExpressionTest, AgreesWithAReferenceOnRandomExpressions) {
  RandomExpression random(1);
  int compared = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string text;
    const double value = random.Write(5, 0, &text);
    Expression expression;
    ExpressionFault fault;
    if (!ParseExpression(text, Header(), &expression, &fault)) {
      // What has no meaning is refused for that alone.
      EXPECT_THAT(fault.what, ::testing::AnyOf(
                                  ::testing::StartsWith("there is no column"),
                                  "a factor that is zero", "a division by zero",
                                  "a number that is not finite"))
          << text;
      continue;
    }
    std::vector<double> cells;
    for (const int column : expression.columns()) cells.push_back(column + 1.0);
    const double got = expression.Evaluate(cells);
    // The same operations in the same order: to the last bit.
    EXPECT_TRUE(got == value || (std::isnan(got) && std::isnan(value)))
        << text << ": " << got << " and not " << value;
    ++compared;
  }
  EXPECT_GT(compared, 15000);
}

}  // namespace
}  // namespace sysid
