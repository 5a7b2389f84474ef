// The part of a system that has none of its own. A system's part defines the same name, with any of these members:
//   choices()                    columns to colour by, before the map's own
//   color                        name of the column it begins with, where that is not the first to choose
//   grows(column)                whether a column's values above 0 mean growth: they are red then, else those below
//   kept                         name → function of a link's text: what of `state` a link keeps beside place and plane
//   shown                        what the console, and the tests, may look at
//   build()                      builds the sections below the map
//   boundaries(xEdges, yEdges)   lines on the plane, as `boundaryLine` makes them
//   slanted()                    what is drawn upwards in place of the plane's own side, where that follows from both
//                                (null where it does not): {label, up(x, y), down(x, shown), clip(y), clipAcross(x)}
//   coordinates()                adds coordinates of points that are no grid to `theMap.coordinates` and `theMap.cloud`
//   say(place)                   the point in one sentence
//   guides()                     lines on the picture of such points, as Plotly's traces
//   first()                      the place at which the page begins
//   buildTable()                 builds the map where `theMap.table` says that it is a table and no plane

const part = {};
