// The part of a system that has none of its own. A system's part defines the same name, with any of these members:
//   choices()                    columns to colour by, before the map's own
//   color                        name of the column it begins with, where that is not the first to choose
//   grows(column)                whether a column's values above 0 mean growth: they are red then, else those below
//   kept                         name → function of a link's text: what of `state` a link keeps beside place and plane
//   rates()                      eigenvalues [real, imaginary] of the modes in which a described system is shown moving
//                                (see mode.js); null where its motion is periodic
//   shown                        what the console, and the tests, may look at
//   build()                      builds the sections below the map
//   boundaries(xEdges, yEdges)   lines on the plane, as `boundaryLine` makes them
//   possible(x, y), impossible(xEdges, yEdges)   whether a body can be at a point of the plane, and outlines of where none can
//   landmarks()                  points of the plane with names: {name, x, y, side}
//   shownAt(), pointName()       where the chosen point stands, if not on a cell, and what it is called
//   drag(x, y)                   chooses a point between the cells, to which the ring is dragged
//   adjust(changes)              completes what is about to be chosen
//   between()                    {rows, words} in place of what is measured, where the choice is between points; or null
//   aside(place)                 what is to be said after the place
//   hides                        names of dimensions without a control of their own
//   opening()                    what else is chosen when a page opens without a link
//   lecture(), begin(), leave()  steps of the lecture (see lecture.js), what starts each, and what to choose after them
//   slanted()                    what is drawn upwards in place of the plane's own side, where that follows from both
//                                (null where it does not): {label, up(x, y), down(x, shown), clip(y)}
//   coordinates()                adds coordinates of points that are no grid to `theMap.coordinates` and `theMap.cloud`
//   say(place)                   the point in one sentence
//   guides()                     lines on the picture of such points, as Plotly's traces
//   first()                      the place at which the page begins
//   buildTable()                 builds the map where `theMap.table` says that it is a table and no plane

const part = {};
