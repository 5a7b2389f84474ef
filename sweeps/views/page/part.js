// The part of a system that has none of its own. A system's part defines the same name, with any of these members:
//   choices()                    columns to colour by, before the map's own
//   build()                      builds the sections below the map
//   start(place)                 moments, axis, omega0, epsilon and phase of the motion that `motion.js` draws
//   nudged                       whether that motion's nudge may be drawn larger
//   boundaries(xEdges, yEdges)   lines on the plane, as `boundaryLine` makes them
//   first()                      the place at which the page begins
//   buildTable()                 builds the map where `theMap.table` says that it is a table and no plane

const part = {};
