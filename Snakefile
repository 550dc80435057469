# This folder is a project as `ajgdata new` creates one. Its workflow is workflow/Snakefile.
configfile: "config/config.yaml"


module ajg:
    snakefile:
        "workflow/Snakefile"
    config:
        config


use rule * from ajg


# Snakemake calls only the handlers of this file.
onstart:
    ajg.onstart()


onsuccess:
    ajg.onsuccess()
