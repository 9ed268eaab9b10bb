#include "asperity/study/report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "asperity/io/atomic_file.h"
#include "asperity/io/image_io.h"
#include "asperity/study/detail/page.h"
#include "asperity/study/detail/page_data.h"

namespace asperity {
namespace {

std::string page(const std::string& title, const nlohmann::json& data, const std::optional<Picture>& picture) {
  const std::string image =
      picture ? fmt::format(
                    "<img id=\"picture-image\" alt=\"The touched surface with the stroke, coloured by force\" "
                    "width=\"{}\" height=\"{}\" src=\"data:image/png;base64,{}\">",
                    picture->image.width, picture->image.height, base64(picture->png))
              : std::string();
  return page_html(title, data, 0, image);
}

std::string share(double fraction) {
  return fraction < 1e-4 ? "less than 0.01 %" : fmt::format("{:.2g} %", 100.0 * fraction);
}

std::string length_words(double metres) {
  return metres < 1e-9 ? "less than a nanometre" : format_length(metres);
}

std::string height_words(const RunMetrics& m) {
  if (m.height.samples == 0)
    return m.height.excluded > 0 ? "touched only within a texel of steps" : "was not in contact along the stroke";
  if (m.height.amplitude > 0.0) {
    return fmt::format("followed a relief of {} to within {} RMS ({} of its height)", format_length(m.height.amplitude),
                       length_words(m.height.rms_error), share(m.height.relative_error));
  }
  return fmt::format("stayed on the surface to within {} RMS", length_words(m.height.rms_error));
}

std::string follow_words(const FollowMetrics& follow) {
  return fmt::format("follow error {}, at most {}", share(follow.global), share(follow.max));
}

/// Energies within this share of what the contact took up are rounding and sampling, not activity.
bool passive(const EnergyMetrics& energy) {
  return energy.generated <= 1e-3 * energy.absorbed + 1e-9;
}

}  // namespace

std::string summarise(const RunReport& report) {
  const RunMetrics& m = report.metrics;
  std::string text = fmt::format("{} ticks at {:.6g} Hz ({:.3g} s), {} of them in contact. ", m.ticks.ticks,
                                 m.ticks.rate, m.ticks.duration, m.ticks.contact);
  if (m.ticks.contact == 0) return text + "Nothing was touched: no force was felt.";
  text += fmt::format("The probe travelled {:.3g} mm and felt {:.3g} N on average, {:.3g} N at most. It {}. ",
                      1e3 * m.ticks.length, m.force.mean, m.force.max, height_words(m));
  if (m.torque.max > 0.0)
    text += fmt::format("About its grip the tool was turned with {:.3g} mN m on average, {:.3g} mN m at most. ",
                        1e3 * m.torque.mean, 1e3 * m.torque.max);
  if (m.follow.samples > 0) {
    text += fmt::format(
        "Its follow error, the way it strayed from the isosurface's value, was {} of the volume's largest "
        "difference, {} at the most. ",
        share(m.follow.global), share(m.follow.max));
  }
  text += passive(m.energy)
              ? "The contact gave back no more energy than it had taken. "
              : fmt::format("The contact gave back {:.3g} mJ more than it had taken. ", 1e3 * m.energy.generated);
  text += m.ticks.safety_interventions == 0
              ? "The safety stage changed nothing. "
              : fmt::format("The safety stage changed {} ticks. ", m.ticks.safety_interventions);
  return text +
         fmt::format("An update took {:.3g} us (median), {:.3g} us at p99.9.", 1e6 * m.update.p50, 1e6 * m.update.p999);
}

std::string verdict(const RunMetrics& m) {
  if (m.ticks.contact == 0) return "no contact";
  std::string text =
      m.height.samples == 0
          ? std::string(m.height.excluded > 0 ? "contact only within a texel of steps" : "no contact along the stroke")
      : m.follow.samples > 0      ? follow_words(m.follow)
      : m.height.amplitude <= 0.0 ? std::string("no relief to follow")
                                  : fmt::format("height error {} of the relief", share(m.height.relative_error));
  if (m.height.amplitude > 0.0 && m.height.excursion < 0.05 * m.height.amplitude) text += "; renders no height";
  const double degrees = m.direction.mean * 180.0 / std::numbers::pi;
  if (m.direction.samples > 0)
    text += degrees < 0.01 ? "; direction right" : fmt::format("; direction {:.2g} deg off on average", degrees);
  text += passive(m.energy) ? "; feeds no energy" : fmt::format("; feeds {:.2g} mJ", 1e3 * m.energy.generated);
  if (m.ticks.safety_interventions > 0) text += fmt::format("; {} ticks limited", m.ticks.safety_interventions);
  return text;
}

Result<std::string> run_report_html(const RunReport& report) {
  ASPERITY_CHECK(check_series(report.series, "series"));
  return page(report.origin.title + " - Asperity run", run_data(report), report.picture);
}

Result<std::string> compare_report_html(const CompareReport& report) {
  if (report.entries.empty()) return bad_value("has no laws to compare", "entries", "one law or more");
  for (std::size_t i = 0; i < report.entries.size(); ++i)
    ASPERITY_CHECK(check_series(report.entries[i].series, fmt::format("entries[{}].series", i)));
  return page(report.origin.title + " - Asperity comparison", compare_data(report), report.picture);
}

Status write_run_report(const std::filesystem::path& path, const RunReport& report) {
  ASPERITY_TRY(const std::string html, run_report_html(report));
  return write_file_atomically(path, html);
}

Status write_compare_report(const std::filesystem::path& path, const CompareReport& report) {
  ASPERITY_TRY(const std::string html, compare_report_html(report));
  return write_file_atomically(path, html);
}

}  // namespace asperity
