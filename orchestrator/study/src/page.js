// Draws every figure of the page where its data stand.
for (const script of document.querySelectorAll("script.figure")) {
  const { data, layout } = JSON.parse(script.textContent);
  Plotly.newPlot(script.dataset.plot, data, layout, { responsive: true, displaylogo: false });
}
