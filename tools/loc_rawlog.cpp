// loc-rawlog: a recording as an MRPT rawlog, for MRPT's programs. (The other way: loc-driver rawlog FILE.)

#include <CLI/CLI.hpp>

#include "libloc/io/rawlog.hpp"
#include "tools/support/log.hpp"
#include "tools/support/open_image_source.hpp"
#include "tools/support/program.hpp"

int main(int argc, char** argv) {
  loc::SourceSpec input;
  std::string output;
  loc::Program program("loc-rawlog", "Writes a recording as an MRPT rawlog: IMU, magnetometer, pictures, GPS.");
  CLI::App& app = program.app();
  app.add_option("INPUT", input.path, "The recording: EuRoC folder (with its pictures), LCM log, CSV, NMEA, …")
      ->required();
  app.add_option("OUTPUT", output, "*.rawlog")->required();
  app.add_option("--input-kind", input.kind, "euroc, lcm-log, csv, eqvio, broad, nmea; otherwise by its looks")
      ->check(CLI::IsMember({"euroc", "lcm-log", "csv", "eqvio", "broad", "nmea"}));

  return program.run(argc, argv, [&] {
    if (input.kind.empty()) input.kind = loc::guess_source_kind(input.path);
    input.images.wanted = input.kind == "euroc";
    const auto source = loc::open_source_with_images(input);
    const auto writer = loc::create_rawlog(output);
    while (const auto measurement = source->next()) {
      if (loc::stop_requested()) {
        loc::log_error("event=interrupted effect=\"{} was not written\"", output);
        return loc::kExitFailed;
      }
      writer->write(*measurement);
    }
    writer->finish();
    loc::log_info("event=written file=\"{}\" {} {}", output, loc::format_counts(source->counts()),
                  loc::format_counts(writer->counts()));
    return loc::kExitOk;
  });
}
