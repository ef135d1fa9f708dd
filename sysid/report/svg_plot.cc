#include "sysid/report/svg_plot.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sysid/io/cell.h"

namespace sysid {
namespace {

constexpr char kFont[] = "DejaVu Sans, Helvetica, Arial, sans-serif";
constexpr char kInk[] = "#333333";

std::string Escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else if (c == '"') {
      out += "&quot;";
    } else {
      out += c;
    }
  }
  return out;
}

// Pixels, to a hundredth; far outside is as good as outside.
std::string Px(double value) {
  std::string text = Format("%.2f", std::clamp(value, -1e5, 1e5));
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string Words(double x, double y, const std::string& text,
                  const std::string& anchor, double size,
                  const std::string& colour, const std::string& more = "") {
  return "<text x=\"" + Px(x) + "\" y=\"" + Px(y) + "\" text-anchor=\"" +
         anchor + "\" font-size=\"" + Px(size) + "\" fill=\"" + colour + "\"" +
         more + ">" + Escaped(text) + "</text>\n";
}

// An element that is still open.
std::string Rectangle(double x, double y, double width, double height) {
  return "<rect x=\"" + Px(x) + "\" y=\"" + Px(y) + "\" width=\"" + Px(width) +
         "\" height=\"" + Px(height) + "\"";
}

std::string Stroke(const std::string& colour, double width,
                   const std::string& dashes) {
  return " fill=\"none\" stroke=\"" + colour + "\" stroke-width=\"" +
         Px(width) + "\"" +
         (dashes.empty() ? "" : " stroke-dasharray=\"" + dashes + "\"");
}

// Where ticks are, at 1, 2 or 5 times a power of ten; every so many decades on
// a logarithmic axis.
std::vector<double> Ticks(const PlotAxis& axis) {
  std::vector<double> ticks;
  if (axis.logarithmic) {
    const int first =
        static_cast<int>(std::ceil(std::log10(axis.lower) - 1e-9));
    const int last =
        static_cast<int>(std::floor(std::log10(axis.upper) + 1e-9));
    const int every = std::max(1, (last - first + 4) / 5);
    for (int d = first; d <= last; d += every) ticks.push_back(std::pow(10, d));
    return ticks;
  }
  const double rough = (axis.upper - axis.lower) / 5.0;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  const double part = rough / power;
  const double step = power * (part < 1.5   ? 1
                               : part < 3.5 ? 2
                               : part < 7.5 ? 5
                                            : 10);
  for (double t = std::ceil(axis.lower / step - 1e-9) * step;
       t <= axis.upper + 1e-9 * step; t += step) {
    ticks.push_back(std::abs(t) < 1e-9 * step ? 0.0 : t);
  }
  return ticks;
}

// Where on the axis a value is: 0 at its lower end, 1 at the upper one.
double PartOf(const PlotAxis& axis, double value) {
  return axis.logarithmic
             ? std::log(value / axis.lower) / std::log(axis.upper / axis.lower)
             : (value - axis.lower) / (axis.upper - axis.lower);
}

}  // namespace

PlotAxis AxisOver(const std::string& label, const std::vector<double>& values,
                  bool logarithmic) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double value : values) {
    if (!std::isfinite(value) || (logarithmic && value <= 0)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  if (!(low <= high)) low = logarithmic ? 0.1 : 0.0, high = 1.0;
  PlotAxis axis{label, low, high, logarithmic};
  if (logarithmic) {
    const double margin = std::max(1.15, std::pow(high / low, 0.04));
    axis.lower = low / margin;
    axis.upper = high * margin;
  } else {
    const double size = std::max(std::abs(low), std::abs(high));
    const double margin =
        high > low ? 0.05 * (high - low) : std::max(0.05 * size, 1e-12);
    axis.lower = low - margin;
    axis.upper = high + margin;
  }
  return axis;
}

SvgPanel::SvgPanel(const PlotBox& box, const PlotAxis& x, const PlotAxis& y,
                   const std::string& title)
    : box_(box), x_(x), y_(y), title_(title) {}

double SvgPanel::X(double value) const {
  return box_.x + box_.width * PartOf(x_, value);
}

double SvgPanel::Y(double value) const {
  return box_.y + box_.height * (1.0 - PartOf(y_, value));
}

void SvgPanel::Line(const std::vector<double>& x, const std::vector<double>& y,
                    const std::string& colour, double width,
                    const std::string& dashes) {
  std::string points;
  const auto flush = [&] {
    if (!points.empty()) {
      marks_ += "<polyline points=\"" + points + "\"" +
                Stroke(colour, width, dashes) + "/>\n";
    }
    points.clear();
  };
  for (size_t i = 0; i < x.size(); ++i) {
    const double px = X(x[i]), py = Y(y[i]);
    if (!std::isfinite(px) || !std::isfinite(py)) {
      flush();
      continue;
    }
    points += (points.empty() ? "" : " ") + Px(px) + "," + Px(py);
  }
  flush();
}

void SvgPanel::Band(const std::vector<double>& x,
                    const std::vector<double>& lower,
                    const std::vector<double>& upper,
                    const std::string& colour) {
  std::string points;
  for (size_t i = 0; i < x.size(); ++i) {
    points += Px(X(x[i])) + "," + Px(Y(upper[i])) + " ";
  }
  for (size_t i = x.size(); i-- > 0;) {
    points += Px(X(x[i])) + "," + Px(Y(lower[i])) + " ";
  }
  marks_ += "<polygon points=\"" + points + "\" fill=\"" + colour +
            "\" fill-opacity=\"0.18\"/>\n";
}

void SvgPanel::Marker(double x, double y, const std::string& colour,
                      double radius) {
  if (!std::isfinite(X(x)) || !std::isfinite(Y(y))) return;
  marks_ += "<circle cx=\"" + Px(X(x)) + "\" cy=\"" + Px(Y(y)) + "\" r=\"" +
            Px(radius) + "\" fill=\"" + colour + "\"/>\n";
}

void SvgPanel::Cross(double x, double y, const std::string& colour) {
  constexpr double kArm = 5.0;
  const double px = X(x), py = Y(y);
  if (!std::isfinite(px) || !std::isfinite(py)) return;
  marks_ += "<path d=\"M" + Px(px - kArm) + " " + Px(py) + "H" + Px(px + kArm) +
            "M" + Px(px) + " " + Px(py - kArm) + "V" + Px(py + kArm) + "\"" +
            Stroke(colour, 1.8, "") + "/>\n";
}

void SvgPanel::Cell(double x0, double y0, double x1, double y1,
                    const std::string& colour) {
  marks_ += Rectangle(X(x0), Y(y1), X(x1) - X(x0), Y(y0) - Y(y1)) + " fill=\"" +
            colour + "\"/>\n";
}

void SvgPanel::Ellipse(double x, double y, const double a[2], const double b[2],
                       const std::string& colour, const std::string& dashes) {
  constexpr int kPoints = 73;
  std::vector<double> xs, ys;
  for (int i = 0; i < kPoints; ++i) {
    const double angle = 2.0 * M_PI * i / (kPoints - 1);
    xs.push_back(x + std::cos(angle) * a[0] + std::sin(angle) * b[0]);
    ys.push_back(y + std::cos(angle) * a[1] + std::sin(angle) * b[1]);
  }
  Line(xs, ys, colour, 1.6, dashes);
}

void SvgPanel::Note(const std::string& text, const std::string& colour) {
  constexpr double kLine = 18.0;
  ++notes_;
  notes_text_ += Words(box_.x + box_.width + 18, box_.y + kLine * notes_, text,
                       "start", 11.5, colour);
}

std::string SvgPanel::Axes() const {
  constexpr double kTick = 4.0;
  std::string text = Rectangle(box_.x, box_.y, box_.width, box_.height) +
                     Stroke(kInk, 1.0, "") + "/>\n";
  const double bottom = box_.y + box_.height, right = box_.x + box_.width;
  for (const double t : Ticks(x_)) {
    text += "<path d=\"M" + Px(X(t)) + " " + Px(bottom) + "v" + Px(kTick) +
            "\"" + Stroke(kInk, 1.0, "") + "/>\n" +
            Words(X(t), bottom + 16, Format("%g", t), "middle", 10.5, kInk);
  }
  for (const double t : Ticks(y_)) {
    text += "<path d=\"M" + Px(box_.x) + " " + Px(Y(t)) + "h" + Px(-kTick) +
            "\"" + Stroke(kInk, 1.0, "") + "/>\n" + "<path d=\"M" + Px(box_.x) +
            " " + Px(Y(t)) + "H" + Px(right) + "\"" +
            Stroke("#dddddd", 0.5, "") + "/>\n" +
            Words(box_.x - 7, Y(t) + 3.5, Format("%g", t), "end", 10.5, kInk);
  }
  text += Words(box_.x + 0.5 * box_.width, bottom + 31, x_.label, "middle",
                11.5, kInk);
  const double middle = box_.y + 0.5 * box_.height, left = box_.x - 56;
  text +=
      Words(left, middle, y_.label, "middle", 11.5, kInk,
            " transform=\"rotate(-90 " + Px(left) + " " + Px(middle) + ")\"");
  return text + Words(box_.x + 0.5 * box_.width, box_.y - 8, title_, "middle",
                      12, kInk, " font-weight=\"bold\"");
}

std::string SvgPanel::Text() const {
  const std::string id =
      "clip" + Px(box_.x) + "_" + Px(box_.y);  // unique: panels do not overlap
  return Axes() + "<clipPath id=\"" + id + "\">" +
         Rectangle(box_.x, box_.y, box_.width, box_.height) +
         "/></clipPath>\n" + "<g clip-path=\"url(#" + id + ")\">\n" + marks_ +
         "</g>\n" + notes_text_;
}

std::string SvgFigure(double width, double height, const std::string& title,
                      const std::vector<SvgPanel>& panels,
                      const std::vector<LegendEntry>& legend) {
  constexpr double kLetter = 6.4;  // pixels, on average
  std::string text = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" +
                     Px(width) + "\" height=\"" + Px(height) +
                     "\" viewBox=\"0 0 " + Px(width) + " " + Px(height) +
                     "\" font-family=\"" + kFont + "\">\n" +
                     "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n" +
                     Words(0.5 * width, 22, title, "middle", 14, kInk);
  for (const SvgPanel& panel : panels) text += panel.Text();
  double total = 0.0;
  for (const LegendEntry& entry : legend) {
    total += 46 + kLetter * static_cast<double>(entry.text.size());
  }
  double x = 0.5 * (width - total) + 10;
  const double y = height - 14;
  for (const LegendEntry& entry : legend) {
    text += "<path d=\"M" + Px(x) + " " + Px(y - 4) + "h24\"" +
            Stroke(entry.colour, 2.2, entry.dashes) + "/>\n" +
            Words(x + 30, y, entry.text, "start", 11.5, kInk);
    x += 46 + kLetter * static_cast<double>(entry.text.size());
  }
  return text + "</svg>\n";
}

}  // namespace sysid
