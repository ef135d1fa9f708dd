#pragma once

#include <string>
#include <vector>

namespace sysid {

// Plots as SVG, just what the figures of reports need: panels with linear or
// logarithmic axes, lines, bands, markers, shaded cells. Points that are not
// finite (or not positive on a logarithmic axis) interrupt a line.

struct PlotAxis {
  std::string label;
  double lower = 0.0, upper = 1.0;
  bool logarithmic = false;
};

// The range of all finite values (positive ones where logarithmic), a little
// wider; never empty.
PlotAxis AxisOver(const std::string& label, const std::vector<double>& values,
                  bool logarithmic = false);

struct PlotBox {
  double x, y, width, height;  // of the area within the axes, pixels
};

class SvgPanel {
 public:
  SvgPanel(const PlotBox& box, const PlotAxis& x, const PlotAxis& y,
           const std::string& title);

  void Line(const std::vector<double>& x, const std::vector<double>& y,
            const std::string& colour, double width = 1.6,
            const std::string& dashes = "");
  void Band(const std::vector<double>& x, const std::vector<double>& lower,
            const std::vector<double>& upper, const std::string& colour);
  void Marker(double x, double y, const std::string& colour,
              double radius = 3.5);
  void Cross(double x, double y, const std::string& colour);
  // A rectangle of the data's coordinates.
  void Cell(double x0, double y0, double x1, double y1,
            const std::string& colour);
  // x0, y0 and the two half axes as vectors, in the data's coordinates.
  void Ellipse(double x, double y, const double a[2], const double b[2],
               const std::string& colour, const std::string& dashes = "");
  // A line of words beside the panel on its right, from the top.
  void Note(const std::string& text, const std::string& colour);

  std::string Text() const;  // with axes

 private:
  double X(double value) const;
  double Y(double value) const;
  std::string Axes() const;

  PlotBox box_;
  PlotAxis x_, y_;
  std::string title_, marks_, notes_text_;
  int notes_ = 0;
};

struct LegendEntry {
  std::string text, colour, dashes;
};

// The whole figure: a title, panels, a legend in a row at the bottom.
std::string SvgFigure(double width, double height, const std::string& title,
                      const std::vector<SvgPanel>& panels,
                      const std::vector<LegendEntry>& legend);

}  // namespace sysid
