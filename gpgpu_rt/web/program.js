// Shows the text of a program. The method's own files are open, other files are folded, and kernels are marked.

const FILE = "// ==== ";     // begins the line that names the file of the following lines

function showText(text, kernels) {
    const parts = [];
    for (const line of text.trimEnd().split("\n")) {
        if (line.startsWith(FILE) || !parts.length) {
            const file = line.startsWith(FILE) ? line.slice(FILE.length) : "";
            const own = file.includes("glsl/methods/") || file.startsWith("/"), last = parts[parts.length - 1];
            if (!last || own || last.own) parts.push({own, files: [], lines: []});
            if (file) parts[parts.length - 1].files.push(file.split(":")[0]);
        }
        parts[parts.length - 1].lines.push(line);
    }
    const alone = !parts.some(({own}) => own);
    element("text").replaceChildren(...parts.map(({own, files, lines}) => {
        while (!lines[lines.length - 1].trim()) lines.pop();
        const part = document.createElement("details"), title = document.createElement("summary");
        const body = document.createElement("pre");
        part.open = own || alone;
        title.textContent = `${files.length > 3 ? `${files.length} parts, ${files[0]} to ${files[files.length - 1]}`
            : files.join(", ") || "the program"} (${lines.length} lines)`;
        body.append(...marked(files.length === 1 ? lines.slice(1) : lines, kernels));
        part.append(title, body);
        return part;
    }));
    element("text").scrollTop = 0;
    element("text").dataset.present = "";
}

// Returns the lines as nodes of the page. Each kernel's lines form an element <mark>.
function marked(lines, kernels) {
    const found = [];
    for (let at = 0; at < lines.length; ++at) {
        const name = (lines[at].match(/^void (\w+)\(/) || [])[1], kernel = kernels.indexOf(name);
        if (kernel < 0 || lines[at].endsWith(";")) {
            found.push(`${lines[at]}\n`);
            continue;
        }
        const first = at;
        while (!lines[at].startsWith("}") && !(at === first && lines[at].endsWith("}"))) ++at;
        const mark = document.createElement("mark");
        mark.dataset.kernel = name;
        mark.className = `kernel-${Math.min(kernel, 3) + 1}`;
        mark.textContent = `${lines.slice(first, at + 1).join("\n")}\n`;
        found.push(mark);
    }
    return found;
}

// Marks the kernel for which the clicked ray waits. With `scrolls`, also scrolls to this kernel, unless the last call
// with `scrolls` was for the same kernel.
function markKernel(kernel, scrolls) {
    const box = element("text"), marks = [...box.querySelectorAll("mark")];
    for (const mark of marks) mark.classList.toggle("present", mark.dataset.kernel === kernel);
    const found = marks.find((mark) => mark.dataset.kernel === kernel);
    if (found && scrolls && box.dataset.present !== kernel) {
        box.scrollTop += found.getBoundingClientRect().top - box.getBoundingClientRect().top - 48;
    }
    if (scrolls) box.dataset.present = kernel;
}
