// Left and right go from one event to the next; without it the links do the same.
document.addEventListener("keydown", function (key) {
  var step = { ArrowLeft: -1, ArrowRight: 1 }[key.key];
  if (!step || key.altKey || key.ctrlKey || key.metaKey || key.shiftKey) return;
  var entries = Array.prototype.slice.call(document.querySelectorAll(".events > li"));
  var here = document.activeElement.closest(".events > li");
  var to = entries[entries.indexOf(here) + step];
  if (!here || !to) return;
  key.preventDefault();
  to.focus();
});
