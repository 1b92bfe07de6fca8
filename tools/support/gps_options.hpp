// The GPS sources on a command line: nmea FILE, gps-serial DEVICE, gps-tcp HOST:PORT, gpsd [HOST[:PORT]].
#pragma once

#include "tools/support/cli_forward.hpp"
#include "tools/support/open_source.hpp"

namespace loc {

/// Adds the four subcommands; the one that is called sets kind, path and what else it has.
void add_gps_sources(CLI::App& app, SourceSpec& spec);

}  // namespace loc
